"""Stability of step levels: the eigenvalues of DT^2 M^-1 K_eff lie between 0 and 4.

K_eff is symmetric, so a leapfrog step then has the spectral radius 1. On chains of random elements, whose levels
change every few elements and whose steps are exactly the steps of their level, the rule for nu is compared with others.
"""

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.division import chebyshev
from reflowshock.fem.division.chebyshev import Substeps
from reflowshock.fem.division.choose_levels import StepLimits, governing_steps, least_steps
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.loads.damping import RayleighDamping
from reflowshock.fem.mesh.tie import Tie
from reflowshock.fem.model.power_iteration import highest_frequency
from reflowshock.materials.library import SAC405
from reflowshock.materials.parameters import Isotropic
from reflowshock.materials.roles import ELASTIC, Materials
from tests.support.fem_levels import joint_on_board, levelled

ELEMENTS, SAMPLES = 12, 60
CELLS = np.column_stack([np.arange(ELEMENTS), np.arange(1, ELEMENTS + 1)]).astype(np.int32)
RATIOS = [(2,), (3,), (7,), (40,), (2, 2), (3, 2), (10, 4), (2, 2, 2), (5, 2, 3), (3, 3, 3), (3, 2, 3, 2)]


def chain_stiffness(levels: np.ndarray, stiffness: np.ndarray, chosen: int) -> np.ndarray:
    """Return the stiffness of the elements of one level of a chain."""
    matrix = np.zeros((ELEMENTS + 1, ELEMENTS + 1))
    for e in np.flatnonzero(levels == chosen):
        matrix[e : e + 2, e : e + 2] += stiffness[e] * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return matrix


def chain_effective(
    levels: np.ndarray, stiffness: np.ndarray, mass: np.ndarray, ratios: tuple[int, ...], step_limits: StepLimits
) -> np.ndarray:
    """Return K_eff of a chain by executing the substeps for all columns."""

    def effective(number: int, around: float) -> np.ndarray:
        level_matrix = chain_stiffness(levels, stiffness, number)
        inner = around / ratios[number - 1] if number else around
        matrix = level_matrix + (effective(number + 1, inner) if number < len(ratios) else 0.0)
        if number == 0:
            return matrix
        outer = np.zeros(ELEMENTS + 1, dtype=bool)
        outer[CELLS[levels < number]] = True
        steps, displacement = Substeps.of(ratios[number - 1], number, step_limits.damping), np.eye(ELEMENTS + 1)
        change, total = np.zeros_like(displacement), np.zeros_like(displacement)
        for memory, rate, weight in zip(steps.memory, steps.rate, steps.weight, strict=True):
            force = matrix @ displacement
            total += weight * force
            change = memory * change - rate * around**2 * np.where(outer, 0.0, 1.0 / mass)[:, None] * force
            displacement = displacement + change
        return total

    return effective(0, step_limits.window)


def extreme_eigenvalues(
    random: np.random.Generator, ratios: tuple[int, ...], fraction: float, damping: float
) -> tuple[float, float]:
    """Return the smallest and the largest eigenvalue of DT^2 M^-1 K_eff of a random chain; DT is 1."""
    step_limits = StepLimits(np.ones(ELEMENTS), np.ones(ELEMENTS), 1.0, fraction, damping)
    limits = least_steps(ratios, step_limits) / fraction
    runs = random.integers(1, 7, ELEMENTS)
    level = np.repeat(random.integers(0, len(limits), ELEMENTS), runs)[:ELEMENTS]
    steps = limits[level] * random.uniform(1.0, random.choice([1.0 + 1e-9, 1.3, 4.0]), ELEMENTS)
    impedance = 10.0 ** np.repeat(random.uniform(-1.0, 1.0, ELEMENTS), runs)[:ELEMENTS]
    stiffness, mass = impedance / steps, np.zeros(ELEMENTS + 1)
    np.add.at(mass, CELLS, 0.5 * (impedance * steps)[:, None])
    needed = governing_steps(CELLS, Tie.none(), fraction * steps)
    levels = np.sum(needed[:, None] < fraction * limits[:-1], axis=1)
    matrix = chain_effective(levels, stiffness, mass, ratios, step_limits)
    assert np.abs(matrix - matrix.T).max() <= 1e-9 * np.abs(matrix).max()
    values = np.linalg.eigvalsh((matrix + matrix.T) / (2.0 * np.sqrt(np.outer(mass, mass))))
    return values[0], values[-1]


def grown(fraction: float, ratios: tuple[int, ...], damping: float = 0.0) -> int:
    """Return the number of unstable random chains; damping half a step late requires z (1 + 2 damping) <= 4."""
    random = np.random.default_rng(sum(ratios))
    extremes = [extreme_eigenvalues(random, ratios, fraction, damping) for _ in range(SAMPLES)]
    return sum(high * (1.0 + 2.0 * damping) > 4.0 or low < -4e-9 for low, high in extremes)


@pytest.mark.parametrize("fraction", [0.5, 0.9, 0.95])
@pytest.mark.parametrize("ratios", RATIOS, ids=str)
def test_random_chains_do_not_grow(fraction, ratios):
    assert grown(fraction, ratios) == 0


@pytest.mark.parametrize("damping", [0.006, 0.03])
@pytest.mark.parametrize("ratios", RATIOS[::3], ids=str)
def test_damped_chains_do_not_grow(damping, ratios):
    assert grown(0.9, ratios, damping) == 0


def test_chains_without_stabilisation_or_with_the_same_on_all_levels_do_grow(monkeypatch):
    monkeypatch.setattr(chebyshev, "FIRST", 0.0)
    assert sum(grown(0.9, ratios) for ratios in RATIOS) > 0
    monkeypatch.setattr(chebyshev, "FIRST", 0.15)
    monkeypatch.setattr(chebyshev, "GROWTH", 1.0)
    assert sum(grown(0.9, ratios) for ratios in RATIOS if len(ratios) > 1) > 0


def of_impedance(ratio: float) -> Isotropic:
    """Return solder with ``ratio`` times the stiffness and density, hence the same wave speed."""
    return Isotropic(
        density=ratio * SAC405.density, young_modulus=ratio * SAC405.young_modulus, poisson_ratio=SAC405.poisson_ratio
    )


@pytest.mark.parametrize("impedance", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("ratios", [(2,), (12,), (40,), (7, 3), (4, 3, 3)], ids=str)
def test_joint_tied_to_a_board_does_not_grow(impedance, ratios):
    model = levelled(joint_on_board(), Materials(solder=of_impedance(impedance)), ratios)
    body = model.body
    assert highest_frequency(MPI.COMM_SELF, body, body.terms, body.mass).critical_step >= model.window


@pytest.mark.parametrize("edges", [1, 3, 6], ids=["ratio 1.2", "ratio 3.8", "ratio 7.5"])
def test_mesh_ratios_do_not_grow(edges):
    model = levelled(joint_on_board(solder=5, edges=edges), ELASTIC, (6, 3))
    body = model.body
    assert highest_frequency(MPI.COMM_SELF, body, body.terms, body.mass).critical_step >= model.window


@pytest.mark.parametrize("samples", [10, pytest.param(50, marks=pytest.mark.long)])
def test_energy_stays_over_many_windows(samples):
    model = levelled(joint_on_board(solder=4), ELASTIC, (5, 3))
    body = model.body
    motion = ExplicitMotion(body, [], model.window, np.empty(0, np.int32), np.zeros(len(body.mass)))
    motion.launch(np.array([1.0, 0.5, -0.3]))
    energies = []
    for _ in range(samples):
        energies.append(motion.kinetic_energy() + motion.internal_energy().strain)
        for _ in range(200):
            motion.advance()
            motion.update_force()
    assert np.ptp(energies) <= 1e-10 * energies[0]


@pytest.mark.parametrize("damping", [0.006, 0.03])
def test_damping_dissipates_the_missing_energy(damping):
    """With the largest damping that levels permit, the highest modes, which it affects most, decay as well."""
    model = levelled(joint_on_board(solder=4), ELASTIC, (5, 3), damping=damping)
    loads = [RayleighDamping.build(model.body, 0.0, damping * model.window)]
    motion = ExplicitMotion(model.body, loads, model.window, np.empty(0, np.int32), np.zeros(len(model.body.mass)))
    motion.launch(np.array([1.0, 0.5, -0.3]))
    held = []
    for _ in range(40):
        held.append((motion.kinetic_energy() + motion.internal_energy().strain, motion.damping_energy))
        for _ in range(20):
            motion.advance()
            motion.update_force()
    energy, taken = np.array(held).T
    assert np.ptp(energy + taken) <= 1e-10 * energy[0]
    assert np.diff(energy).max() < 0.0
