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

LONGEST_MOTION = 0.1  # of the smallest gap, in one exchange
SAMPLES = 41  # heights at which a package that floats is tried
MOST_EXCHANGES = 40

Floats = NDArray[np.float64]


class NotInBalance(RuntimeError):
    """The exchanges of a load step did not reach the tolerance."""


class Joints(Protocol):
    """The joints of an array, wherever they are computed."""

    def exchange(self, number: int, places: "Mapping[str, JointGeometry]") -> Mapping[str, Floats]:
        """Bring all joints to rest in their places; return the wrenches `(2, 6)` of each on its pads, in its frame.

        Args:
            number: of the exchange, from 0 on without a gap; the last one may be asked for again.
            places: joint name -> geometry.
        """


@dataclass(frozen=True, slots=True)
class Scale:
    """Scales of the residuals: the pull of surface tension.

    Attributes:
        pull: pi a gamma, times the pad's radius a for moments, shape (joints, 2, 6) [N, N m].
        rigid: Pull of all joints along each rigid motion, shape (k,) [N, N m].
        tolerance: Tolerance of both residuals.
    """

    pull: Floats
    rigid: Floats
    tolerance: float


@dataclass(frozen=True, slots=True)
class Exchange:
    """What one exchange left.

    Attributes:
        load_step: number of the load step.
        force_residual: largest change of a wrench on the structure; 0 where wrenches do not bend it.
        rigid_residual: largest imbalance of a package that floats; 0 where it does not.
    """

    load_step: int
    force_residual: float
    rigid_residual: float

    @property
    def residual(self) -> float:
        """The larger one."""
        return max(self.force_residual, self.rigid_residual)


@dataclass(slots=True)
class Coupled:
    """Where the coupling is: all that a run needs to continue.

    Attributes:
        wrenches: `(joints, 2, 6)` [N, N m] of the last exchange, in space.
        rigid: `(k,)` [m, rad] of the structure's last state.
        balance: search for the rigid motions.
        load_step: number of the load step.
        state: of the structure, in the exchange that is going on or was the last one.
        pending: whether the joints have not answered to this state yet.
        exchanges: all that are done.
        pad_motion: `(joints, 2, 6)` of each load step that is in balance.
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
    """Solder and structure through all load steps.

    Attributes:
        structure: board and package.
        joints: of the array.
        drawn: joint name -> geometry as drawn, in the order of the structure's pads.
        scale: what is small.
        bends: whether the solder's wrenches bend the structure.
        save: called with the state before the joints are asked, and in the end.
        tell: called with each exchange that is done.
    """

    structure: "HeatedStructure"
    joints: Joints
    drawn: "Mapping[str, JointGeometry]"
    scale: Scale
    bends: bool
    save: Callable[[Coupled], None]
    tell: Callable[[Exchange], None]

    def run(self, coupled: Coupled, steps: Sequence[LoadStep]) -> Coupled:
        """Take all load steps that are left.

        Args:
            coupled: where to begin or to continue; changed in place.
            steps: the load steps.

        Raises:
            NotInBalance: names load step, temperature and residuals.
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
        while True:
            if not coupled.pending:
                bending = coupled.wrenches if self.bends else np.zeros_like(coupled.wrenches)
                coupled.state = self.structure.solve(step.temperature, step.corner, bending, coupled.rigid)
                coupled.pending = True
                self.save(coupled)
            exchange = self._exchange(coupled)
            self.tell(exchange)
            if exchange.residual <= self.scale.tolerance:
                return
            done = [past for past in coupled.exchanges if past.load_step == coupled.load_step]
            if len(done) >= MOST_EXCHANGES:
                raise NotInBalance(
                    f"load step {coupled.load_step + 1} at {step.temperature:.1f} K: after {len(done)} exchanges "
                    f"forces still change by {exchange.force_residual:.2e} and the package is out of balance by "
                    f"{exchange.rigid_residual:.2e} of the pull of surface tension, allowed {self.scale.tolerance:g}"
                )

    def _exchange(self, coupled: Coupled) -> Exchange:
        """Compute the joints' wrenches, record the residuals, and choose the next trial."""
        assert coupled.state is not None
        answer = self._answer(coupled.state.pad_motion, len(coupled.exchanges))
        change = np.abs(answer - coupled.wrenches) / self.scale.pull
        modes = self.structure.rigid_modes
        imbalance = modes.imbalance(answer)
        exchange = Exchange(
            coupled.load_step,
            float(change.max()) if self.bends else 0.0,
            float((np.abs(imbalance) / self.scale.rigid).max(initial=0.0)),
        )
        coupled.exchanges.append(exchange)
        coupled.wrenches, coupled.pending = answer, False
        if exchange.rigid_residual > self.scale.tolerance:
            coupled.rigid = coupled.balance.next(coupled.rigid, imbalance)
        return exchange

    def _answer(self, pad_motion: Floats, number: int) -> Floats:
        """Wrenches `(joints, 2, 6)` in space of the joints between pads that have moved."""
        from scipy.spatial.transform import Rotation

        found = self.joints.exchange(number, placed(self.drawn, pad_motion))
        local = np.array([found[name] for name in self.drawn]).reshape(-1, 2, 2, 3)
        turns = Rotation.from_rotvec(pad_motion[:, 0, 3:]).as_matrix()
        return np.einsum("jik,jswk->jswi", turns, local).reshape(-1, 2, 6)


def placed(drawn: "Mapping[str, JointGeometry]", pad_motion: Floats) -> "dict[str, JointGeometry]":
    """Return each joint between pads that have moved, seen from its board's pad.

    Args:
        drawn: joint name -> geometry as drawn.
        pad_motion: `(joints, 2, 6)` [m, rad].
    """
    from reflowshock.particles.core.plate import joint_plates, placed_geometry

    return {
        name: placed_geometry(
            geometry, [plate.moved(own) for plate, own in zip(joint_plates(geometry), motion, strict=True)]
        )
        for (name, geometry), motion in zip(drawn.items(), pad_motion, strict=True)
    }


def scale_of(geometries: "Sequence[JointGeometry]", solder: Solder, modes: "RigidModes", tolerance: float) -> Scale:
    """Return the scales of the residuals: pi a gamma for forces, times the pad's radius a for moments."""
    radii = np.array([(geometry.radius_board, geometry.radius_package) for geometry in geometries])
    force = np.pi * radii * solder.surface_tension
    pull = np.repeat(np.stack((force, force * radii), axis=-1), 3, axis=-1)
    way = np.linalg.norm(modes.pad_motion[:, :, 1, :3], axis=-1)
    turn = np.linalg.norm(modes.pad_motion[:, :, 1, 3:], axis=-1) * radii[:, 1]
    return Scale(pull, (np.maximum(way, turn) * force[:, 1]).sum(axis=1), tolerance)


def start(geometries: "Sequence[JointGeometry]", solder: Solder, modes: "RigidModes") -> Coupled:
    """Return the initial state of the coupling: no wrenches, a floating package at its equilibrium height.

    Args:
        geometries: Geometries of the joints between the pads of the structure without solder.
        solder: Solder of one joint.
        modes: Free rigid motions of the package.
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
    """
    from scipy.optimize import brentq

    from reflowshock.particles.scenes.carried_joint import axial_force

    def excess(gap: float) -> float:
        return axial_force(geometry, solder, gap) - load

    gaps = geometry.gap * np.linspace(0.4, 1.6, SAMPLES)
    left = np.array([excess(gap) for gap in gaps])
    found = np.flatnonzero((left[:-1] > 0.0) & (left[1:] <= 0.0))
    if not len(found):
        return geometry.gap
    first = found[np.argmin(np.abs(gaps[found] - geometry.gap))]
    return float(brentq(excess, gaps[first], gaps[first + 1], rtol=1e-6))
