"""Hexahedral meshes of solder joints, made from their closed surfaces; start with ``solder_mesh.py``."""
