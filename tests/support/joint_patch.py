"""One joint between a patch of board and a patch of substrate: geometry, materials, motion, and a conforming mesh.

The scene of the independent oracle (``joint_oracle.py``) and of the program's runs (``joint_program.py``). z = 0 is the
face of the board, x = y = 0 the axis of the joint; only the half y >= 0 of the symmetric body is meshed. The substrate
is held at its sides x = -+side/2, the board at x = -side/2; its other side moves outwards and away from the substrate.
This pulls, shears and bends the joint.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from reflowshock.materials.library import COPPER, FR4
from reflowshock.materials.parameters import Isotropic, JohnsonCook, Material

Floats = NDArray[np.float64]
UM = 1e-6
SOLDER = Isotropic(
    density=7440.0, young_modulus=44.6e9, poisson_ratio=0.40, plasticity=JohnsonCook(A=40e6, B=1e9, n=1.0)
)


@dataclass(frozen=True, slots=True)
class JointPatch:
    """Dimensions [m] and materials; ``standoff`` is the height of the solder between two copper pads.

    Attributes:
        stretch: Mean strain of the board at the full motion, along x.
        lift: Lift [m] of the moved side of the board; 6 um bend its ends to a fibre strain of 2e-3.
    """

    side: float = 3e-3
    board: float = 1e-3
    substrate: float = 0.4e-3
    pad_radius: float = 0.24e-3
    standoff: float = 0.30e-3
    copper: float = 0.02e-3
    stretch: float = 2e-3
    lift: float = 6e-6
    materials: dict[str, Material] = field(
        default_factory=lambda: {"board": FR4, "copper": COPPER, "solder": SOLDER, "substrate": FR4}
    )

    @property
    def faces(self) -> Floats:
        """Heights [m] of the faces of the joint, shape (4,), from board/copper to copper/substrate."""
        return np.cumsum([0.0, self.copper, self.standoff, self.copper])

    @property
    def pad_area(self) -> float:
        """Area of a pad [m^2]."""
        return float(np.pi * self.pad_radius**2)

    @property
    def full_motion(self) -> Floats:
        """Displacement [m], shape (3,), of the board's moved side."""
        return np.array([self.stretch * self.side, 0.0, -self.lift])


@dataclass(frozen=True, slots=True)
class Fineness:
    """Mesh settings of a patch: elements per eighth of the rim, and lines [m] near edges and faces.

    Attributes:
        sectors: Edges over 45 degrees of the rim; the core has twice this number along x.
        inside: Distances [m] of rings from the rim, inwards.
        outside: Distances [m] of rings from the rim, outwards.
        solder: Levels [m] from either pad to the middle of the joint, included.
        copper: Layers of either pad.
        board: Levels [m] below the top face of the board, bottom face included.
        substrate: Levels [m] above the lower face of the substrate, upper face included.
    """

    sectors: int
    inside: tuple[float, ...]
    outside: tuple[float, ...]
    solder: tuple[float, ...]
    copper: int
    board: tuple[float, ...]
    substrate: tuple[float, ...]


# Quadratic meshes: forces and moments of the elastic patch change by 2 % to the next mesh, then by 1 %.
QUADRATIC = {
    "coarse": Fineness(
        sectors=2,
        inside=(20 * UM,),
        outside=(40 * UM, 200 * UM, 600 * UM),
        solder=(12.5 * UM, 25 * UM, 50 * UM),
        copper=1,
        board=(60 * UM, 200 * UM, 500 * UM),
        substrate=(100 * UM,),
    ),
    "middle": Fineness(
        sectors=3,
        inside=(10 * UM, 40 * UM),
        outside=(15 * UM, 60 * UM, 200 * UM, 500 * UM, 900 * UM),
        solder=(12.5 * UM, 25 * UM, 50 * UM, 100 * UM),
        copper=1,
        board=(30 * UM, 90 * UM, 250 * UM, 550 * UM),
        substrate=(40 * UM, 150 * UM),
    ),
    "fine": Fineness(
        sectors=4,
        inside=(5 * UM, 15 * UM, 50 * UM),
        outside=(6 * UM, 20 * UM, 60 * UM, 150 * UM, 300 * UM, 600 * UM, 900 * UM),
        solder=(6.25 * UM, 12.5 * UM, 25 * UM, 50 * UM, 100 * UM),
        copper=2,
        board=(12 * UM, 40 * UM, 100 * UM, 250 * UM, 550 * UM),
        substrate=(15 * UM, 50 * UM, 150 * UM),
    ),
}
# Meshes of the program's 8-node hexahedra.
TRILINEAR = {
    "coarse": Fineness(
        sectors=2,
        inside=(40 * UM,),
        outside=(80 * UM, 250 * UM, 600 * UM),
        solder=(12.5 * UM, 25 * UM, 50 * UM, 100 * UM),
        copper=1,
        board=(60 * UM, 200 * UM, 500 * UM),
        substrate=(80 * UM, 200 * UM),
    ),
    "middle": Fineness(
        sectors=4,
        inside=(20 * UM, 60 * UM),
        outside=(30 * UM, 80 * UM, 150 * UM, 250 * UM, 400 * UM, 600 * UM, 850 * UM),
        solder=(12.5 * UM, 25 * UM, 50 * UM, 100 * UM),
        copper=1,
        board=(40 * UM, 90 * UM, 160 * UM, 260 * UM, 400 * UM, 560 * UM, 760 * UM),
        substrate=(40 * UM, 90 * UM, 160 * UM, 260 * UM),
    ),
    "fine": Fineness(
        sectors=6,
        inside=(10 * UM, 25 * UM, 45 * UM, 75 * UM),
        outside=tuple(UM * line for line in (12, 30, 60, 100, 160, 240, 350, 480, 630, 800, 1000)),
        solder=tuple(UM * line for line in (6.25, 12.5, 18.75, 25, 37.5, 50, 75, 100)),
        copper=2,
        board=tuple(UM * line for line in (15, 35, 65, 110, 170, 250, 350, 480, 620, 800)),
        substrate=tuple(UM * line for line in (15, 35, 65, 110, 170, 250, 320)),
    ),
}


@dataclass(frozen=True, slots=True)
class Lattice:
    """Hexahedra of polynomial degree d in lattice order: node a + (d + 1) b + (d + 1)^2 c is at (a, b, c) / d.

    Attributes:
        points: Node positions [m], shape (n, 3).
        cells: Part -> nodes, shape (ne, (d + 1)^3).
    """

    points: Floats
    cells: dict[str, NDArray[np.int64]]


def mesh_patch(patch: JointPatch, fineness: Fineness, degree: int) -> Lattice:
    """Mesh a patch with rings around the joint's axis; board, joint and substrate share their nodes.

    Args:
        patch: Dimensions and materials.
        fineness: Numbers of elements and grid lines.
        degree: Polynomial degree of the elements.

    Returns:
        Nodes, and the nodes of the hexahedra of each part.
    """
    blocks = [*_disc(patch, fineness, degree), *_surroundings(patch, fineness, degree)]
    plane = np.concatenate([block for block, _ in blocks])
    within = np.concatenate([np.full(len(block), inside) for block, inside in blocks])
    corners = np.round(plane.reshape(-1, 2) / patch.side, 9) + 0.0  # no -0.0
    places, number = np.unique(corners, axis=0, return_inverse=True)
    quads, places = number.reshape(len(plane), -1), places * patch.side
    levels, cells, start = [], {}, 0
    for part, heights in _stack(patch, fineness):
        chosen = quads if part in ("board", "substrate") else quads[within]
        lines = _divided(heights, degree)
        levels.append(lines if not start else lines[1:])
        layers = start + degree * np.arange(len(heights) - 1)
        rows = [len(places) * (layer + np.arange(degree + 1)) for layer in layers]
        swept = [(chosen[:, None, :] + row[:, None]).reshape(len(chosen), -1) for row in rows]
        cells[part] = np.concatenate([*([cells[part]] if part in cells else []), *swept])
        start += len(lines) - 1
    heights = np.concatenate(levels)
    points = np.column_stack([np.tile(places, (len(heights), 1)), np.repeat(heights, len(places))])
    used, number = np.unique(np.concatenate([item.ravel() for item in cells.values()]), return_inverse=True)
    ends = np.cumsum([item.size for item in cells.values()])[:-1]
    parts = zip(cells, np.split(number.ravel(), ends), strict=True)
    return Lattice(points[used], {part: item.reshape(-1, (degree + 1) ** 3) for part, item in parts})


def _stack(patch: JointPatch, fineness: Fineness) -> Iterator[tuple[str, Floats]]:
    """Yield the parts from below with their levels [m]."""
    foot, pad, end, head = patch.faces
    half = np.append(fineness.solder, 0.5 * patch.standoff)
    yield "board", foot - np.append(patch.board, fineness.board[::-1] + (0.0,))
    yield "copper", np.linspace(foot, pad, fineness.copper + 1)
    yield "solder", np.concatenate([[pad], pad + half, end - half[-2::-1], [end]])
    yield "copper", np.linspace(end, head, fineness.copper + 1)
    yield "substrate", head + np.concatenate([[0.0], fineness.substrate, [patch.substrate]])


def _divided(lines: Floats, degree: int) -> Floats:
    """Return lines with the intermediate nodes of a degree."""
    return np.interp(np.arange(degree * (len(lines) - 1) + 1) / degree, np.arange(len(lines)), lines)


def _quads(nodes: Floats, degree: int) -> Floats:
    """Return the cells ``(nq, (d + 1)^2, 2)`` of a grid of nodes ``(nb, na, 2)``, b the slow direction."""
    count = [(size - 1) // degree for size in nodes.shape[:2]]
    step = np.arange(degree + 1)
    b = degree * np.arange(count[0])[:, None, None, None] + step[:, None]
    a = degree * np.arange(count[1])[:, None, None] + step
    return nodes[b, a].reshape(count[0] * count[1], -1, 2)


def _angles(fineness: Fineness, degree: int) -> Floats:
    return np.linspace(0.0, np.pi, 4 * fineness.sectors * degree + 1)


def _polar(angle: Floats, radius: Floats) -> Floats:
    """Return points ``(nt, nr, 2)`` of radii ``(nt, nr)``."""
    return radius[:, :, None] * np.column_stack([np.cos(angle), np.sin(angle)])[:, None]


def _square(angle: Floats) -> Floats:
    """Return the distance ``(nt, 1)`` of a square of half width one from its centre."""
    return 1.0 / np.maximum(np.abs(np.cos(angle)), np.abs(np.sin(angle)))[:, None]


def _disc(patch: JointPatch, fineness: Fineness, degree: int) -> Iterator[tuple[Floats, bool]]:
    """Yield the cells of the pad: a square core, rings around it."""
    core = 0.5 * patch.pad_radius
    lines = core * np.tan(np.linspace(-0.25 * np.pi, 0.25 * np.pi, 2 * fineness.sectors * degree + 1))
    x, y = np.meshgrid(lines, lines[fineness.sectors * degree :])
    yield _quads(np.stack([x, y], axis=2), degree), True
    angle = _angles(fineness, degree)
    depth = np.array([0.0, *fineness.inside, patch.pad_radius - core])[::-1]
    share = 1.0 - _divided(depth, degree) / depth[0]
    yield _quads(_polar(angle, (1.0 - share) * core * _square(angle) + share * patch.pad_radius), degree), True


def _surroundings(patch: JointPatch, fineness: Fineness, degree: int) -> Iterator[tuple[Floats, bool]]:
    """Yield the cells outside the pad: rings whose outline becomes the square of the patch."""
    angle = _angles(fineness, degree)
    reach = 0.5 * patch.side - patch.pad_radius
    share = _divided(np.array([0.0, *fineness.outside, reach]), degree) / reach
    radius = (1.0 - share) * patch.pad_radius + share * 0.5 * patch.side * _square(angle)
    yield _quads(_polar(angle, radius), degree), False
