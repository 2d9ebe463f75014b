"""Gmsh sessions, quality of elements, sections and outlines: what boards and joints share."""
