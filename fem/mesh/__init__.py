"""Serial meshes before partitioning: parts, facets, ties, coupling interface, watch tables; start with ``mesh.py``."""
