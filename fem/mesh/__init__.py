"""Meshes before they are distributed: parts, facets, ties, the coupling interface, watch tables."""
