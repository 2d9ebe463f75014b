"""Tools that boards and joints share: Gmsh sessions, element quality, sections and outlines of facets."""
