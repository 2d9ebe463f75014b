"""Input, interface and state of board and package during reflow."""

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
    """Input for board and package during reflow.

    Attributes:
        mesh: Gmsh file of board and package, flat at the reference temperature.
        pads: Pads of the joints.
        materials: Material of each role.
        thermal: Temperature profile and effects; without ``effects.solder_force``, wrenches cause no deformation.
        gravity: Gravity along -z [m/s^2].
    """

    mesh: Path
    pads: Pads
    materials: Materials
    thermal: Thermal
    gravity: float


@dataclass(frozen=True, slots=True)
class RigidModes:
    """Rigid-body motions of the package that only the solder resists.

    Attributes:
        names: Names of the motions: ``x``, ``y``, ``z`` [m], ``turn_x``, ``turn_y``, ``turn_z`` [rad] about the centre
            of the pads.
        pad_motion: Motion of the pads for a unit of each motion, shape (k, joints, 2, 6).
        weight: Force of gravity along each motion, shape (k,) [N, N m].
    """

    names: tuple[str, ...]
    pad_motion: NDArray[np.float64]
    weight: NDArray[np.float64]

    def imbalance(self, wrenches: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return weight plus wrenches, shape (joints, 2, 6), along each motion, shape (k,) [N, N m]; zero at rest."""
        return self.weight + np.tensordot(self.pad_motion, wrenches, 3)


@dataclass(frozen=True, slots=True)
class HeatedState:
    """State of board and package under given loads.

    Attributes:
        displacement: Nodal displacement, shape (n, 3) [m].
        pad_motion: Displacement [m] and rotation vector [rad] of the pads on board and package, shape (joints, 2, 6).
        corner_force: Upward forces that move the die corners, shape (c,) [N]; empty if the package floats.
    """

    displacement: NDArray[np.float64]
    pad_motion: NDArray[np.float64]
    corner_force: NDArray[np.float64]


class HeatedStructure(Protocol):
    """Interface of board and package during reflow, elastic or rigid, in this process or another."""

    @property
    def points(self) -> NDArray[np.float64]:
        """Nodes in the undeformed state, shape (n, 3) [m]."""

    @property
    def package(self) -> NDArray[np.bool_]:
        """Whether a node belongs to the package, shape (n,)."""

    @property
    def rigid_modes(self) -> RigidModes:
        """Free rigid-body motions of the package."""

    def solve(
        self, temperature: float, corner: float, wrenches: NDArray[np.float64], rigid: NDArray[np.float64]
    ) -> HeatedState:
        """Return the state at a temperature [K].

        Args:
            temperature: Temperature [K].
            corner: Upward displacement of the die corners [m]; no effect if the package floats.
            wrenches: Forces and moments about the pad centres of the solder, shape (joints, 2, 6) [N, N m].
            rigid: Amplitudes of the free rigid-body motions, shape (k,) [m, rad].
        """


def check_loads(modes: RigidModes, wrenches: NDArray[np.float64], rigid: NDArray[np.float64]) -> None:
    """Check the shapes of loads on a package that is held by its solder, and that they are finite.

    Args:
        modes: Rigid-body motions of the package, k of them.
        wrenches: Force [N] and moment [N m] on each pad, shape (joints, 2, 6); side 0 is the board, 1 the package.
        rigid: Amplitudes of the rigid-body motions [m, rad], shape (k,).

    Raises:
        ValueError: A shape is wrong, or a value is not finite.
    """
    for name, values, expected in (
        ("wrenches", wrenches, modes.pad_motion.shape[1:]),
        ("rigid", rigid, modes.weight.shape),
    ):
        if np.shape(values) != expected or not np.isfinite(values).all():
            finite = "" if np.isfinite(values).all() else ", not all finite"
            raise ValueError(f"{name} has the shape {np.shape(values)}{finite}; required: finite, shape {expected}")
