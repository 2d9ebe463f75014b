"""A joint's surface as hexahedra or tetrahedra in its place; start with `solder_mesh.py`."""
