"""Gmsh files of hexahedra read by meshio."""

import meshio
import numpy as np

from reflowshock.meshing.core.hexahedra import quad_areas, volumes


class MeshFile:
    """Points, and cells by the names of their physical groups."""

    def __init__(self, path):
        self.mesh = meshio.read(path)
        self.points = self.mesh.points

    def cells(self, name, kind="hexahedron"):
        """Return the cells of a physical group."""
        blocks = zip(self.mesh.cells, self.mesh.cell_sets[name], strict=True)
        return np.vstack([block.data[chosen] for block, chosen in blocks if block.type == kind and len(chosen)])

    def volume(self, name):
        return volumes(self.points, self.cells(name)).sum()

    def area(self, name):
        return quad_areas(self.points, self.cells(name, "quad")).sum()
