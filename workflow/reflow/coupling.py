"""Staggered coupling of solder and structure: wrenches and pad motions are exchanged until each load step balances.

In a load step, W are the wrenches that bend the structure, q the rigid motions of a floating package:

    pads = structure(temperature, corner, W, q),     W' = joints(pads)

The structure is so much stiffer than surface tension that W <- W' contracts by about 1e-4; Newton's method finds q from
the residual of weight and W'. Both residuals are divided by the pull of surface tension, pi a gamma per joint. One-way
coupling neglects bending under W and solves for q only.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from reflowshock.particles.parameters.solder import Solder
from reflowshock.workflow.reflow.forecast import LoadStep
from reflowshock.workflow.reflow.rigid_balance import RigidBalance

if TYPE_CHECKING:
    from reflowshock.fem.statics.state import HeatedState, HeatedStructure, RigidModes
    from reflowshock.particles.core.geometry import JointGeometry

LONGEST_MOTION = 0.1  # largest motion in one exchange, as a share of the smallest gap
SAMPLES = 41  # heights among which the equilibrium of a floating package is bracketed
MOST_EXCHANGES = 40

Floats = NDArray[np.float64]


class NotInBalance(RuntimeError):
    """Error for a load step whose exchanges do not reach the tolerance."""


class Joints(Protocol):
    """Interface of the joints of an array in the coupling."""

    def exchange(self, number: int, places: "Mapping[str, JointGeometry]") -> Mapping[str, Floats]:
        """Bring all joints to rest between displaced pads.

        Args:
            number: Number of the exchange, counted from 0; the last exchange may be repeated.
            places: Present geometry by joint name.

        Returns:
            Wrenches of each joint on its two pads, in the frame of the joint, shape (2, 6) [N, N m].
        """


@dataclass(frozen=True, slots=True)
class Scale:
    """Scales of the residuals: the pull of surface tension.

    Attributes:
        pull: Capillary pull pi a gamma, times the pad's radius a for moments, shape (joints, 2, 6) [N, N m].
        rigid: Pull of all joints along each rigid motion, shape (k,) [N, N m].
        tolerance: Tolerance of both residuals.
    """

    pull: Floats
    rigid: Floats
    tolerance: float


@dataclass(frozen=True, slots=True)
class Exchange:
    """Residuals of an exchange, relative to the pull of surface tension.

    Attributes:
        load_step: Number of the load step, counted from 0.
        force_residual: Largest change of a wrench on the structure; 0 in one-way coupling.
        rigid_residual: Largest imbalance of a floating package; 0 if the package does not float.
    """

    load_step: int
    force_residual: float
    rigid_residual: float

    @property
    def residual(self) -> float:
        """Larger of both residuals."""
        return max(self.force_residual, self.rigid_residual)


@dataclass(slots=True)
class Coupled:
    """State of the coupling, from which a run can continue.

    Attributes:
        wrenches: Wrenches of the joints on their pads in the last exchange, in space, shape (joints, 2, 6) [N, N m].
        rigid: Rigid motions of the package, shape (k,) [m, rad].
        balance: Quasi-Newton iteration for the rigid motions.
        load_step: Number of the load step, counted from 0.
        state: State of the structure in the present or last exchange; None before the first.
        pending: Whether the joints have not been computed for this state yet.
        exchanges: Completed exchanges.
        pad_motion: Motion of the pads in each completed load step, shape (joints, 2, 6) [m, rad].
    """

    wrenches: Floats
    rigid: Floats
    balance: RigidBalance
    load_step: int = 0
    state: "HeatedState | None" = None
    pending: bool = False
    exchanges: list[Exchange] = field(default_factory=list)
    pad_motion: list[Floats] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Coupling:
    """Staggered coupling of solder and structure over all load steps.

    Attributes:
        structure: Board and package.
        joints: Joints of the array.
        drawn: Geometry as drawn by joint name, in the order of the structure's pads.
        scale: Scales and tolerance of the residuals.
        bends: Whether the solder's wrenches bend the structure (two-way coupling).
        save: Function that saves the state, called before the joints are computed and at the end.
        report: Function that is called with each completed exchange.
    """

    structure: "HeatedStructure"
    joints: Joints
    drawn: "Mapping[str, JointGeometry]"
    scale: Scale
    bends: bool
    save: Callable[[Coupled], None]
    report: Callable[[Exchange], None]

    def run(self, coupled: Coupled, steps: Sequence[LoadStep]) -> Coupled:
        """Compute the remaining load steps.

        Args:
            coupled: Initial state, or the state of an interrupted run; changed in place.
            steps: All load steps.

        Returns:
            The state after the last load step.

        Raises:
            NotInBalance: A load step does not converge; the message gives its temperature and residuals.
        """
        while coupled.load_step < len(steps):
            self._balance(coupled, steps[coupled.load_step])
            assert coupled.state is not None
            coupled.pad_motion.append(coupled.state.pad_motion)
            coupled.load_step += 1
            coupled.balance.forget()
        self.save(coupled)
        return coupled

    def _balance(self, coupled: Coupled, step: LoadStep) -> None:
        """Repeat exchanges until a load step is in balance."""
        while True:
            if not coupled.pending:
                bending = coupled.wrenches if self.bends else np.zeros_like(coupled.wrenches)
                coupled.state = self.structure.solve(step.temperature, step.corner, bending, coupled.rigid)
                coupled.pending = True
                self.save(coupled)
            exchange = self._exchange(coupled)
            self.report(exchange)
            if exchange.residual <= self.scale.tolerance:
                return
            count = sum(completed.load_step == coupled.load_step for completed in coupled.exchanges)
            if count >= MOST_EXCHANGES:
                raise NotInBalance(
                    f"load step {coupled.load_step + 1} at {step.temperature:.1f} K: after {count} exchanges "
                    f"forces still change by {exchange.force_residual:.2e} and the package is out of balance by "
                    f"{exchange.rigid_residual:.2e} of the pull of surface tension, allowed {self.scale.tolerance:g}"
                )

    def _exchange(self, coupled: Coupled) -> Exchange:
        """Compute the joints' wrenches, record the residuals, and choose the next trial."""
        assert coupled.state is not None
        wrenches = self._wrenches(coupled.state.pad_motion, len(coupled.exchanges))
        change = np.abs(wrenches - coupled.wrenches) / self.scale.pull
        modes = self.structure.rigid_modes
        imbalance = modes.imbalance(wrenches)
        exchange = Exchange(
            coupled.load_step,
            float(change.max()) if self.bends else 0.0,
            float((np.abs(imbalance) / self.scale.rigid).max(initial=0.0)),
        )
        coupled.exchanges.append(exchange)
        coupled.wrenches, coupled.pending = wrenches, False
        if exchange.rigid_residual > self.scale.tolerance:
            coupled.rigid = coupled.balance.next(coupled.rigid, imbalance)
        return exchange

    def _wrenches(self, pad_motion: Floats, number: int) -> Floats:
        """Return the wrenches of the joints on displaced pads, in space, shape (joints, 2, 6) [N, N m]."""
        from scipy.spatial.transform import Rotation

        by_joint = self.joints.exchange(number, place_joints(self.drawn, pad_motion))
        local = np.array([by_joint[name] for name in self.drawn]).reshape(-1, 2, 2, 3)
        turns = Rotation.from_rotvec(pad_motion[:, 0, 3:]).as_matrix()
        return np.einsum("jik,jswk->jswi", turns, local).reshape(-1, 2, 6)


def place_joints(drawn: "Mapping[str, JointGeometry]", pad_motion: Floats) -> "dict[str, JointGeometry]":
    """Return the geometry of each joint between displaced pads, in the frame of its pad on the board.

    Args:
        drawn: Geometry as drawn by joint name.
        pad_motion: Motion (three translations, three rotations) of the board pad and the package pad of each joint,
            shape (joints, 2, 6) [m, rad].
    """
    from reflowshock.particles.core.plate import joint_plates, placed_geometry

    return {
        name: placed_geometry(
            geometry, [plate.moved(pad) for plate, pad in zip(joint_plates(geometry), motion, strict=True)]
        )
        for (name, geometry), motion in zip(drawn.items(), pad_motion, strict=True)
    }


def scale_of(geometries: "Sequence[JointGeometry]", solder: Solder, modes: "RigidModes", tolerance: float) -> Scale:
    """Return the scales of the residuals: pi a gamma for forces, times the pad's radius a for moments.

    Args:
        geometries: Geometry of each joint, in the order of the structure's pads.
        solder: Solder of one joint.
        modes: Free rigid motions of the package.
        tolerance: Tolerance of the relative residuals.

    Returns:
        Scale of each component of the wrenches, shape (joints, 2, 6), and of each rigid motion, shape (k,) [N, N m].
    """
    radii = np.array([(geometry.radius_board, geometry.radius_package) for geometry in geometries])
    force = np.pi * radii * solder.surface_tension
    pull = np.repeat(np.stack((force, force * radii), axis=-1), 3, axis=-1)
    shift = np.linalg.norm(modes.pad_motion[:, :, 1, :3], axis=-1)
    turn = np.linalg.norm(modes.pad_motion[:, :, 1, 3:], axis=-1) * radii[:, 1]
    return Scale(pull, (np.maximum(shift, turn) * force[:, 1]).sum(axis=1), tolerance)


def start(geometries: "Sequence[JointGeometry]", solder: Solder, modes: "RigidModes") -> Coupled:
    """Return the initial state of the coupling: no wrenches, a floating package at its equilibrium height.

    Args:
        geometries: Geometries of the joints between the pads of the structure without solder.
        solder: Solder of one joint.
        modes: Free rigid motions of the package, with the force of gravity along each.

    Returns:
        State with zero wrenches, rigid motions of the package, and no exchange.
    """
    from reflowshock.particles.scenes.carried_joint import stiffness_estimate

    gaps = np.array([geometry.gap for geometry in geometries])
    middle = geometries[int(np.argsort(gaps)[len(gaps) // 2])]
    stiffness = np.broadcast_to(stiffness_estimate(middle, solder), (len(gaps), 6, 6))
    largest = LONGEST_MOTION * float(gaps.min())
    balance = RigidBalance.start(modes.names, modes.pad_motion, stiffness, largest)
    rigid = np.zeros(len(modes.names))
    if "z" in modes.names:
        number = modes.names.index("z")
        rigid[number] = floating_height(middle, solder, -modes.weight[number] / len(gaps)) - middle.gap
    return Coupled(np.zeros((len(gaps), 2, 6)), rigid, balance)


def floating_height(geometry: "JointGeometry", solder: Solder, load: float) -> float:
    """Return the nearest gap [m] at which a coaxial joint supports a load [N], or else the present gap.

    The force must decrease with the height, otherwise the equilibrium is unstable.

    Args:
        geometry: Joint with its present gap.
        solder: Solder of the joint.
        load: Force with which the package presses on the joint [N].
    """
    from scipy.optimize import brentq

    from reflowshock.particles.scenes.carried_joint import axial_force

    def excess(gap: float) -> float:
        return axial_force(geometry, solder, gap) - load

    gaps = geometry.gap * np.linspace(0.4, 1.6, SAMPLES)
    forces = np.array([excess(gap) for gap in gaps])
    crossings = np.flatnonzero((forces[:-1] > 0.0) & (forces[1:] <= 0.0))
    if not len(crossings):
        return geometry.gap
    first = crossings[np.argmin(np.abs(gaps[crossings] - geometry.gap))]
    return float(brentq(excess, gaps[first], gaps[first + 1], rtol=1e-6))
