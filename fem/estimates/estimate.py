"""Steps and cost before anything is meshed: plain NumPy, for ``plan`` and for the run itself."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.estimates.placement import ModelCost, WindowCost, least_seconds
from reflowshock.fem.problem.shock import Ranks
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.parameters import Material

# Element updates per second and core of a whole substep (force, update, tie) of elements whose matrix is assembled, as
# those of joints, on one core of an AMD EPYC (AVX-512); boards are boxes in rows, which share their matrices.
UPDATES_PER_SECOND = 1.2e7
BOARD_ADVANTAGE = 4.3
ROW_COST = 4.0  # updates of boxes in the time that a row of them takes, however short (boards of graded boxes)
IDLE_COST = 0.15  # updates of assembled elements in the time in which the nodes of one move that does not act
WINDOW_OVERHEAD = 1.5e-4  # [s] interpreter per window, same source
STEP_OVERHEAD = 2.5e-5  # [s] interpreter per step of a motion or of a level inside it, same source
CALL_OVERHEAD = 1.2e-4  # [s] interpreter per window whose steps are one call, same source
LATENCY = 1.5e-5  # [s] a message between two ranks of one machine, same source
PULSE_STEPS = 200  # implicit steps in the shortest pulse: 3e-4 of the period of what swings twice in it
ROUNDING = 1e-9  # of a duration
RUN_STEPS = 1000  # implicit steps in a run, at least
Step = TypeVar("Step", float, NDArray[np.float64])


@dataclass(frozen=True, slots=True)
class WindowPlan:
    """The time steps of a run.

    Attributes:
        window: Coupling interval DT [s], the step of the macro model.
        substeps: m, meso steps per window.
        windows: Number of windows.
        stride: Windows between two history samples.
    """

    window: float
    substeps: int
    windows: int
    stride: int

    @property
    def step(self) -> float:
        """Return dt = DT / m [s]."""
        return self.window / self.substeps


def box_critical_step(material: Material, size: NDArray[np.float64]) -> float:
    """Return the critical step [s] of a box element with edges ``size (3,)`` [m] along the material's axes.

    With the lumped mass the stiffest modes are the uniform strains: omega^2 is the largest eigenvalue of
    4 C_ij / (density h_i h_j) over the normal strains, and 4 G_ij (1/h_i^2 + 1/h_j^2) / density in shear. Incompatible
    modes soften bending below both.
    """
    return _box_critical_step(material, tuple(map(float, size)))


@lru_cache(maxsize=4096)
def _box_critical_step(material: Material, lengths: tuple[float, ...]) -> float:
    """Return the same; a plan asks for the same boxes hundreds of times."""
    elasticity, size = elasticity_matrix(material), np.array(lengths)
    normal = np.linalg.eigvalsh(elasticity[:3, :3] / np.outer(size, size))[-1]
    pairs = ((3, 0, 1), (4, 1, 2), (5, 0, 2))
    shear = max(elasticity[k, k] * (size[i] ** -2.0 + size[j] ** -2.0) for k, i, j in pairs)
    return 1.0 / math.sqrt(max(float(normal), float(shear)) / material.density)


def skewed_critical_step(material: Material, edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the critical steps ``(n,)`` [s] of hexahedra with three edges each, ``(n, 3, 3)`` [m], at any angles.

    The uniform strains are the stiffest modes here, too: u_i = a_ik xi_k with xi from -1 to 1 has the strain of
    a_ik d(xi_k)/dx_j and the kinetic energy of the mass times a_ik^2. Of boxes this is ``box_critical_step``.
    """
    gradient = 2.0 * np.linalg.inv(edges)  # (n, 3, 3): d(xi_k)/dx_j at j, k
    strain = np.zeros((len(edges), 6, 3, 3))  # of a_ik at i, k
    for axis in range(3):
        strain[:, axis, axis] = gradient[:, axis]
    for row, first, second in ((3, 0, 1), (4, 1, 2), (5, 0, 2)):
        strain[:, row, first], strain[:, row, second] = gradient[:, second], gradient[:, first]
    modes = strain.reshape(len(edges), 6, 9)
    stiffness = np.einsum("nai,ab,nbj->nij", modes, elasticity_matrix(material), modes)
    return 2.0 / np.sqrt(np.linalg.eigvalsh(stiffness)[:, -1] / material.density)


def damped_critical_step(critical: Step, stiffness: float) -> Step:
    """Return critical steps [s] with stiffness-proportional damping: dt (sqrt(1 + xi^2) - xi), cancelling nothing.

    Args:
        critical: 2 / omega_max without damping [s], one or many.
        stiffness: beta [s]; the highest mode has xi = beta omega_max / 2.
    """
    ratio = stiffness / critical
    return critical / (np.hypot(1.0, ratio) + ratio)


def window_plan(macro_step: float, meso_step: float, fraction: float, duration: float, samples: int) -> WindowPlan:
    """Choose window and substeps from critical steps; runs of other steps have their samples at the same times.

    Args:
        macro_step: Smallest element critical step of the macro model and of the elements that touch the interface [s].
        meso_step: Smallest element critical step of the meso model [s].
        fraction: Of the critical step that is used.
        duration: Simulated time [s]; a whole number of samples, each a whole number of windows.
        samples: History samples wanted; fewer where there are fewer windows.
    """
    least = math.ceil(duration / (fraction * macro_step))
    samples = min(samples, least)
    stride = math.ceil(least / samples)
    windows = stride * samples
    window = duration / windows
    substeps = math.ceil(window / (fraction * meso_step))
    return WindowPlan(window, substeps, windows, stride)


def implicit_plan(plan: WindowPlan, largest: float) -> WindowPlan:
    """Return windows from sample to sample of another plan, in implicit steps of at most ``largest`` [s]."""
    spacing = plan.stride * plan.window
    return WindowPlan(spacing, math.ceil(spacing / largest), plan.windows // plan.stride, 1)


def shortened(plan: WindowPlan, duration: float) -> WindowPlan:
    """Return the first windows of a plan, up to the sample at a duration [s] or the next one after it."""
    samples = math.ceil(duration / (plan.stride * plan.window) * (1.0 - ROUNDING))
    return replace(plan, windows=min(plan.windows, plan.stride * samples))


def largest_implicit_step(duration: float, pulses: Iterable[float]) -> float:
    """Return the largest implicit step [s] of a run, whatever its mesh.

    On the JEDEC board under its half sine of 0.5 ms, steps of 1/50, 1/100 and 1/200 of the pulse are 5e-4, 1e-4 and
    3e-5 (relative L2) off in the displacement of the centre, 4e-3, 1e-3 and 3e-4 in its strain
    (benchmarks/jedec_oracle.py).

    Args:
        duration: Simulated time [s].
        pulses: Durations of its loads [s].
    """
    return min([duration / RUN_STEPS, *(pulse / PULSE_STEPS for pulse in pulses)])


def predict_seconds(
    macro_elements: float, meso: Sequence[tuple[float, int]], plan: WindowPlan, ranks: Ranks, *, at_once: bool
) -> tuple[float, float]:
    """Predict the wall time of a two-scale and of a DNS run on equal cores.

    Args:
        macro_elements: Elements of the macro model, all boxes of a board.
        meso: Elements of each step level of the meso model, in the cost of assembled ones, and its steps a window.
        plan: Time steps; its substeps are those of a DNS.
        ranks: Their number, and which placements are allowed.
        at_once: Whether a rank that has the meso model for itself takes its steps in one call; that of a DNS does.

    Returns:
        Seconds of the windows of ``two_scale`` and of ``dns``.
    """
    board = macro_elements / BOARD_ADVANTAGE / UPDATES_PER_SECOND
    work = sum(elements * steps for elements, steps in meso) / UPDATES_PER_SECOND
    sums = sum(steps for _, steps in meso)
    calls, message = (CALL_OVERHEAD, LATENCY + STEP_OVERHEAD) if at_once else (sums * STEP_OVERHEAD, LATENCY)
    cost = WindowCost(ModelCost(board, WINDOW_OVERHEAD, 1), ModelCost(work, calls, sums), message)
    two_scale = least_seconds(ranks, cost)
    everything = board + sum(elements for elements, _ in meso) / UPDATES_PER_SECOND
    dns = plan.substeps * (everything / ranks.total + (ranks.total > 1) * (STEP_OVERHEAD + LATENCY)) + CALL_OVERHEAD
    return plan.windows * two_scale, plan.windows * dns
