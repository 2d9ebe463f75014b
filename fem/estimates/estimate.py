"""Time steps and cost predicted before anything is meshed, in plain NumPy for plans and runs."""

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

# Element updates per second of whole substeps (force, update, tie) on one core of an AMD EPYC (AVX-512), for elements
# with one matrix each, such as those of joints; boards are rows of boxes, which share their matrices.
UPDATES_PER_SECOND = 1.2e7
BOARD_ADVANTAGE = 4.3
ROW_COST = 4.0  # fixed cost of a row of boxes, in updates of a box (boards of graded boxes)
IDLE_COST = 0.15  # cost of moving the nodes of an inactive element, in updates of an element with its own matrix
WINDOW_OVERHEAD = 1.5e-4  # [s] interpreter per window, same source
STEP_OVERHEAD = 2.5e-5  # [s] interpreter per step of a motion or of a level inside it, same source
CALL_OVERHEAD = 1.2e-4  # [s] interpreter per window whose steps are one call, same source
LATENCY = 1.5e-5  # [s] a message between two ranks of one machine, same source
PULSE_STEPS = 200  # implicit steps in the shortest pulse: period error 3e-4 of a mode with two periods per pulse
ROUNDING = 1e-9  # relative rounding error of a duration
RUN_STEPS = 1000  # least number of implicit steps in a run
Step = TypeVar("Step", float, NDArray[np.float64])


@dataclass(frozen=True, slots=True)
class WindowPlan:
    """Time steps of a run.

    Attributes:
        window: Coupling interval DT [s], the step of the macro model.
        substeps: Meso steps per window, m.
        windows: Number of windows.
        stride: Windows between two history samples.
    """

    window: float
    substeps: int
    windows: int
    stride: int

    @property
    def step(self) -> float:
        """Meso step dt = DT / m [s]."""
        return self.window / self.substeps


def box_critical_step(material: Material, size: NDArray[np.float64]) -> float:
    """Return the critical time step [s] of a box element.

    With lumped mass the modes with the highest frequency are the uniform strains: omega^2 is the largest eigenvalue of
    4 C_ij / (density h_i h_j) for the normal strains, and 4 G_ij (1/h_i^2 + 1/h_j^2) / density for shear. Incompatible
    modes lower the bending frequencies below both.

    Args:
        material: Material with its elastic constants and density.
        size: Edge lengths h along the material's axes, shape (3,) [m].
    """
    return _box_critical_step(material, tuple(map(float, size)))


@lru_cache(maxsize=4096)
def _box_critical_step(material: Material, lengths: tuple[float, ...]) -> float:
    """Return ``box_critical_step``, cached because a plan evaluates the same boxes hundreds of times."""
    elasticity, size = elasticity_matrix(material), np.array(lengths)
    normal = np.linalg.eigvalsh(elasticity[:3, :3] / np.outer(size, size))[-1]
    pairs = ((3, 0, 1), (4, 1, 2), (5, 0, 2))
    shear = max(elasticity[k, k] * (size[i] ** -2.0 + size[j] ** -2.0) for k, i, j in pairs)
    return 1.0 / math.sqrt(max(float(normal), float(shear)) / material.density)


def skewed_critical_step(material: Material, edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the critical time steps ``(n,)`` [s] of parallelepipeds.

    As in ``box_critical_step``, which is the special case of boxes, the modes with the highest frequency are the
    uniform strains: u_i = a_ik xi_k, with xi from -1 to 1, has the displacement gradient a_ik d(xi_k)/dx_j, and the
    modal masses of all a_ik are equal.

    Args:
        material: Material, with axes along x, y and z.
        edges: Three edge vectors of each element, in its rows, shape (n, 3, 3) [m].
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
    """Return critical time steps [s] with stiffness-proportional damping, dt (sqrt(1 + xi^2) - xi).

    Args:
        critical: Critical steps without damping, 2 / omega_max, a number or an array [s].
        stiffness: Damping coefficient beta [s]; the highest mode has the damping ratio xi = beta omega_max / 2.
    """
    ratio = stiffness / critical  # the result is the formula above without its cancellation
    return critical / (np.hypot(1.0, ratio) + ratio)


def window_plan(macro_step: float, meso_step: float, fraction: float, duration: float, samples: int) -> WindowPlan:
    """Choose window and substeps from critical steps, with samples at times that do not depend on the steps.

    A window is the time between two exchanges of macro and meso model, and the step of the macro model.

    Args:
        macro_step: Smallest critical step of macro elements and of elements at the interface [s].
        meso_step: Smallest critical step of meso elements [s].
        fraction: Time step over critical time step.
        duration: Simulated time [s]; a whole number of samples, each a whole number of windows.
        samples: Requested number of history samples; the plan has fewer if there are fewer windows.

    Returns:
        Window [s], meso substeps per window, number of windows, and windows from one history sample to the next.
    """
    least = math.ceil(duration / (fraction * macro_step))
    samples = min(samples, least)
    stride = math.ceil(least / samples)
    windows = stride * samples
    window = duration / windows
    substeps = math.ceil(window / (fraction * meso_step))
    return WindowPlan(window, substeps, windows, stride)


def implicit_plan(plan: WindowPlan, largest: float) -> WindowPlan:
    """Return a plan with one window from each history sample of another plan to the next, divided into implicit steps.

    Args:
        plan: Plan of a run whose sample times are kept.
        largest: Largest implicit step [s].

    Returns:
        Window [s], implicit steps per window, number of windows; every window ends at a sample.
    """
    spacing = plan.stride * plan.window
    return WindowPlan(spacing, math.ceil(spacing / largest), plan.windows // plan.stride, 1)


def shorten_plan(plan: WindowPlan, duration: float) -> WindowPlan:
    """Return a plan cut after the first sample at or after a duration.

    Args:
        plan: Plan with windows and windows per sample.
        duration: New simulated time [s].

    Returns:
        Plan with the same windows and substeps, and fewer windows unless the duration exceeds the plan.
    """
    samples = math.ceil(duration / (plan.stride * plan.window) * (1.0 - ROUNDING))
    return replace(plan, windows=min(plan.windows, plan.stride * samples))


def largest_implicit_step(duration: float, pulses: Iterable[float]) -> float:
    """Return the largest implicit step [s] of a run, which does not depend on the mesh.

    On the JEDEC board under its half sine of 0.5 ms, steps of 1/50, 1/100 and 1/200 of the pulse have relative L2
    errors of 5e-4, 1e-4 and 3e-5 in the displacement of the centre, 4e-3, 1e-3 and 3e-4 in its strain
    (benchmarks/jedec_oracle.py).

    Args:
        duration: Simulated time [s].
        pulses: Durations of the load pulses [s]; may be empty.
    """
    return min([duration / RUN_STEPS, *(pulse / PULSE_STEPS for pulse in pulses)])


def predict_seconds(
    macro_elements: float, meso: Sequence[tuple[float, int]], plan: WindowPlan, ranks: Ranks, *, at_once: bool
) -> tuple[float, float]:
    """Predict the wall time of a two-scale and of a DNS run on equal cores.

    Args:
        macro_elements: Number of elements of the macro model, all boxes of a board.
        meso: Number of elements (weighted by cost) and number of steps per window of each level of the meso model.
        plan: Time steps; the substeps are the steps of the DNS.
        ranks: Number of ranks and allowed placements.
        at_once: Whether a rank with only the meso model takes all steps of a window in one compiled call, as the DNS.

    Returns:
        Wall time of all windows of the two-scale and of the DNS run [s].
    """
    board = macro_elements / BOARD_ADVANTAGE / UPDATES_PER_SECOND
    work = sum(elements * steps for elements, steps in meso) / UPDATES_PER_SECOND
    sums = sum(steps for _, steps in meso)
    calls, message = (CALL_OVERHEAD, LATENCY + STEP_OVERHEAD) if at_once else (sums * STEP_OVERHEAD, LATENCY)
    cost = WindowCost(ModelCost(board, WINDOW_OVERHEAD, 1), ModelCost(work, calls, sums), message)
    two_scale = least_seconds(ranks, cost)
    everything = board + sum(elements for elements, _ in meso) / UPDATES_PER_SECOND
    dns = plan.substeps * (everything / ranks.most + (ranks.most > 1) * (STEP_OVERHEAD + LATENCY)) + CALL_OVERHEAD
    return plan.windows * two_scale, plan.windows * dns
