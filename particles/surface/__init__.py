"""The free surface: its triangles, level sets, profiles and contact lines."""
