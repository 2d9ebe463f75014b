"""Hexahedral mesh of a body of solder in its own frame, with its wetted faces."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from reflowshock.meshing.board.pad_planes import PadPlanes
from reflowshock.meshing.core.quadratic_tetrahedra import QuadraticTetrahedra

Side = Literal["board", "package"]


@dataclass(frozen=True, slots=True)
class WettedFace:
    """Face of the solder on a pad, oriented counter-clockwise seen from above.

    Attributes:
        side: Side of the pad.
        quads: Nodes of the quadrilaterals, shape (q, 4).
        rim: Nodes of the outline, shape (r,).
    """

    side: Side
    quads: np.ndarray
    rim: np.ndarray


@dataclass(frozen=True, slots=True)
class Solder:
    """Hexahedra of a body of solder.

    Attributes:
        points: Node coordinates in the body's own frame, shape (n, 3) [m].
        cells: Nodes of the hexahedra, shape (c, 8).
        faces: Wetted faces; for a single joint the board's, then the package's.
        volume: Exact volume of the body [m^3].
        scale: Factor by which free outlines were scaled to keep the volume.
        planes: Planes of the pads.
        tetrahedra: Quadratic tetrahedra of a free-form body in the same frame.
    """

    points: np.ndarray
    cells: np.ndarray
    faces: tuple[WettedFace, ...]
    volume: float
    scale: float
    planes: PadPlanes
    tetrahedra: QuadraticTetrahedra | None = None
