"""Structured meshes with named parts of board, package and pads, and of layered boxes; start with ``assembly.py``."""
