"""Gmsh sessions: silent, always finalised, with output as MSH 4.1 in metres."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import gmsh

HEXAHEDRON, QUADRANGLE = 5, 3


@contextmanager
def gmsh_model(name: str) -> Iterator[None]:
    """Open a fresh, silent Gmsh session with one empty model for a ``with`` statement, at whose end Gmsh is closed.

    Sessions cannot be nested, since Gmsh has one session per process. The context yields None.

    Args:
        name: Name of the model in Gmsh.
    """
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add(name)
        yield
    finally:
        gmsh.finalize()


def name_groups(dimension: int, groups: dict[str, list[int]]) -> None:
    """Add physical groups to the current Gmsh model.

    Args:
        dimension: Dimension of the entities: 2 for surfaces, 3 for volumes.
        groups: Group name -> tags of its entities.
    """
    for name, tags in groups.items():
        gmsh.model.addPhysicalGroup(dimension, tags, name=name)


def write_msh(path: Path, scale: float = 1.0) -> None:
    """Write the current Gmsh model as binary MSH 4.1.

    Args:
        path: The ``.msh`` file to write.
        scale: Factor of the coordinates, e.g. 0.001 for a model in millimetres and a file in metres.
    """
    gmsh.option.setNumber("Mesh.ScalingFactor", scale)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.write(str(path))
