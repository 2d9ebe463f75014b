"""Geometry and meshes: Gmsh assembly, closed joint surfaces, swept joint hexahedra."""
