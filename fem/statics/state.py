"""What is asked of board and package during reflow, and what they answer."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.problem.thermal import Thermal
from reflowshock.fem.statics.pads import Pads
from reflowshock.materials.roles import Materials


@dataclass(frozen=True, slots=True)
class Assembly:
    """Board and package that are heated.

    Attributes:
        mesh: Gmsh file of both, flat as at the reference temperature.
        pads: Where the joints sit.
        materials: Material of each role.
        thermal: Course of temperatures; where ``effects.solder_force`` is off, wrenches do not bend anything.
        gravity: [m/s^2] downwards, along -z.
    """

    mesh: Path
    pads: Pads
    materials: Materials
    thermal: Thermal
    gravity: float


@dataclass(frozen=True, slots=True)
class RigidModes:
    """Rigid motions of the package that nothing but the solder resists.

    Attributes:
        names: Of each: ``x``, ``y``, ``z`` [m], ``turn_x``, ``turn_y``, ``turn_z`` [rad] about the centre of its pads.
        pad_motion: ``(k, joints, 2, 6)`` motion of the pads for a unit of each.
        weight: ``(k,)`` [N, N m] force of gravity along each.
    """

    names: tuple[str, ...]
    pad_motion: NDArray[np.float64]
    weight: NDArray[np.float64]

    def imbalance(self, wrenches: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return weight and wrenches ``(joints, 2, 6)`` along each motion ``(k,)`` [N, N m]: zero at rest."""
        return self.weight + np.tensordot(self.pad_motion, wrenches, 3)


@dataclass(frozen=True, slots=True)
class HeatedState:
    """Board and package under given loads.

    Attributes:
        displacement: ``(n, 3)`` [m] at the nodes.
        pad_motion: ``(joints, 2, 6)`` displacement [m] and rotation vector [rad] of the pads, board and package.
        corner_force: ``(c,)`` [N] forces, upwards, that move the corners of the die; none where the package floats.
    """

    displacement: NDArray[np.float64]
    pad_motion: NDArray[np.float64]
    corner_force: NDArray[np.float64]


class HeatedStructure(Protocol):
    """Board and package, elastic or rigid, in this process or another."""

    @property
    def points(self) -> NDArray[np.float64]:
        """Return the nodes ``(n, 3)`` [m] as drawn, each once."""

    @property
    def package(self) -> NDArray[np.bool_]:
        """Return ``(n,)``: whether a node belongs to the package."""

    @property
    def rigid_modes(self) -> RigidModes:
        """Return the free rigid motions of the package."""

    def solve(
        self, temperature: float, corner: float, wrenches: NDArray[np.float64], rigid: NDArray[np.float64]
    ) -> HeatedState:
        """Return the state at a temperature [K].

        Args:
            temperature: [K].
            corner: Displacement of the die's corners [m], upwards; of no effect where the package floats.
            wrenches: ``(joints, 2, 6)`` [N, N m] of the solder on the pads, moments about the centres of the pads.
            rigid: ``(k,)`` [m, rad] amounts of the free rigid motions.
        """


def check_loads(modes: RigidModes, wrenches: NDArray[np.float64], rigid: NDArray[np.float64]) -> None:
    """Raise ``ValueError`` where loads or rigid motions have another shape than the structure, or are no numbers."""
    for name, given, expected in (
        ("wrenches", wrenches, modes.pad_motion.shape[1:]),
        ("rigid", rigid, modes.weight.shape),
    ):
        if np.shape(given) != expected or not np.isfinite(given).all():
            finite = "" if np.isfinite(given).all() else ", not all finite"
            raise ValueError(f"{name} has the shape {np.shape(given)}{finite}; wanted are numbers of shape {expected}")
