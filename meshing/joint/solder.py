"""A body of solder as hexahedra in its own frame, and its wetted faces."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from reflowshock.meshing.board.pad_planes import PadPlanes
from reflowshock.meshing.core.quadratic_tetrahedra import QuadraticTetrahedra

Side = Literal["board", "package"]


@dataclass(frozen=True, slots=True)
class WettedFace:
    """A wetted face of a pad.

    Attributes:
        side: of the solder.
        quads: (q, 4) nodes, counter-clockwise seen from above.
        rim: (r,) nodes of its outline, counter-clockwise seen from above.
    """

    side: Side
    quads: np.ndarray
    rim: np.ndarray


@dataclass(frozen=True, slots=True)
class Solder:
    """Hexahedra of solder.

    Attributes:
        points: (n, 3) in the body's own frame [m].
        cells: (c, 8).
        faces: wetted faces; of a joint the board's, then the package's.
        volume: that the cells are to have in their place [m^3].
        scale: by which free outlines were scaled to have it.
        planes: of its pads.
        tetrahedra: of which free-form hexahedra were made, in the same frame.
    """

    points: np.ndarray
    cells: np.ndarray
    faces: tuple[WettedFace, ...]
    volume: float
    scale: float
    planes: PadPlanes
    tetrahedra: QuadraticTetrahedra | None = None
