"""Board and package as rigid plates: a structure that does not bend, for `coupling` where nothing is flexible."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from workflow.board_drop_case import BoardDropCase

if TYPE_CHECKING:
    from fem.thermal.state import RigidModes, State

Floats = NDArray[np.float64]

NAMES = ("x", "y", "z", "turn_x", "turn_y", "turn_z")
HELD_BY_SYMMETRY = {"full": (), "quarter": ("x", "y", "turn_x", "turn_y", "turn_z")}
HELD_BY_CORNERS = {"floating": (), "moved": ("z", "turn_x", "turn_y")}


@dataclass(frozen=True, slots=True)
class RigidPlates:
    """A rigid package above a rigid board; `fem.thermal.state.Structure`.

    Attributes:
        points: `(n, 3)` nodes of board and package as drawn [m].
        package: `(n,)` whether a node belongs to the package.
        lift: `(n,)` how far a prescribed warpage lifts the package [m].
        modes: the package's free rigid motions.
    """

    points: Floats
    package: NDArray[np.bool_]
    lift: Floats
    modes: "RigidModes"

    @property
    def rigid_modes(self) -> "RigidModes":
        """The package's free rigid motions."""
        return self.modes

    def solve(self, temperature: float, corner: float, wrenches: Floats, rigid: Floats) -> "State":
        """Return the state: rigid motions, and a package that is moved as its corner is; temperature does nothing."""
        from fem.thermal.state import State

        pad_motion = np.tensordot(rigid, self.modes.pad_motion, 1)
        pad_motion[:, 1, 2] += corner
        displacement = np.zeros_like(self.points)
        for name, amount in zip(self.modes.names, rigid, strict=True):
            displacement += amount * motion(name, self.points) * self.package[:, None]
        displacement[:, 2] += (self.lift + corner) * self.package
        return State(displacement, pad_motion, self.modes.imbalance(wrenches), np.zeros(0))


def motion(name: str, points: Floats) -> Floats:
    """Displacement `(n, 3)` for a unit of a rigid motion, turns about the origin."""
    number = NAMES.index(name)
    axis = np.eye(3)[number % 3]
    return np.broadcast_to(axis, points.shape) if number < 3 else np.cross(axis, points)


def free_modes(names: tuple[str, ...], centres: Floats, weight: float) -> "RigidModes":
    """Return free rigid motions of a package whose weight [N] acts at x = y = 0.

    Args:
        names: of the motions.
        centres: `(joints, 3)` of the package's pads [m].
        weight: of the package, or of its part in a quarter model [N].
    """
    from fem.thermal.state import RigidModes

    pads = np.zeros((len(names), len(centres), 2, 6))
    for row, name in zip(pads, names, strict=True):
        row[:, 1, :3] = motion(name, centres)
        if name.startswith("turn"):
            row[:, 1, 3:] = np.eye(3)[NAMES.index(name) - 3]
    return RigidModes(names, pads, np.array([-weight if name == "z" else 0.0 for name in names]))


def free_names(symmetry: str, package: str) -> tuple[str, ...]:
    """Names of the rigid motions that neither symmetry nor moved corners hold."""
    held = (*HELD_BY_SYMMETRY[symmetry], *HELD_BY_CORNERS[package])
    return tuple(name for name in NAMES if name not in held)


def package_weight(case: BoardDropCase) -> float:
    """Weight of substrate and die, of a quarter of them in a quarter model [N]; pads of copper are left out."""
    mass = sum(
        layer.length * layer.width * layer.thickness * getattr(case.materials, role).density
        for role, layer in (("substrate", case.package.substrate), ("die", case.package.die))
    )
    share = 0.25 if case.board.symmetry == "quarter" else 1.0
    return share * mass * case.solder.gravity
