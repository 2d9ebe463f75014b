"""Two-scale coupling against DNS: equality at one substep, and convergence with the window."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.bodies import dns_body, motion_of
from reflowshock.fem.dynamics.energy_balance import EnergyBalance, energy_sums
from reflowshock.fem.loads.load import half_sine_drop
from reflowshock.fem.mesh.mesh import MeshData, append
from reflowshock.materials.library import SAC405
from reflowshock.materials.roles import ELASTIC, Materials
from tests.support.fem_division import by_patch
from tests.support.fem_models import board_mesh, small_assembly
from tests.support.fem_window import Window

PULSE = half_sine_drop(peak=1.5e4, duration=2e-5)
HEAVY = SAC405.elastic.model_copy(update={"density": 4e5})  # as mass scaling does: m stays near 5
THICK_COPPER = Materials(copper=HEAVY)


def board_only() -> MeshData:
    """Return the mesh of a quarter board with elements of 1 mm."""
    return board_mesh(size=1e-3)


def test_one_substep_a_window_is_the_dns():
    """The exchange has no lag: with m = 1 the coupled models equal one model to round-off."""
    window = Window(board_only(), ELASTIC, 0.9, by_patch, [PULSE])
    assert window.plan.substeps == 1
    body, _ = dns_body(board_only())
    dns = motion_of(body, window.plan.step, [PULSE])
    for _ in range(400):
        window.run()
        dns.advance()
        dns.update_force()
    largest = np.abs(dns.displacement).max()
    for part in (window.macro, window.meso):
        twin = matching(part.motion.body.local.points, body.local.points)
        assert np.abs(part.motion.displacement - dns.displacement[twin]).max() < 1e-11 * largest


def matching(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return for each point the index of the other point at the same position."""
    keys = [tuple(row) for row in np.round(others * 1e9).astype(int)]
    number = {key: k for k, key in enumerate(keys)}
    return np.array([number[tuple(row)] for row in np.round(points * 1e9).astype(int)])


def die_history(fraction: float, duration: float) -> tuple[Window, float]:
    """Run two-scale and DNS; return the window and the relative L2 error of the die centre."""
    mesh = append(small_assembly(size=1e-3 / 2))
    window = Window(mesh, THICK_COPPER, fraction, loads=[PULSE])
    body, _ = dns_body(mesh, materials=THICK_COPPER)
    dns = motion_of(body, window.plan.step, [PULSE])
    top = body.local.points[:, 2].max()
    corner = np.array([0.0, 0.0, top])
    nodes = [
        int(np.argmin(np.linalg.norm(part.local.points - corner, axis=1))) for part in (window.meso.motion.body, body)
    ]
    ours, reference = [], []
    while dns.time < duration:
        window.run()
        for _ in range(window.plan.substeps):
            dns.advance()
            dns.update_force()
        ours.append(window.meso.motion.displacement[nodes[0]].copy())
        reference.append(dns.displacement[nodes[1]].copy())
    return window, float(np.linalg.norm(np.array(ours) - reference) / np.linalg.norm(reference))


def test_two_scale_follows_the_dns_and_improves_with_the_window():
    window, coarse = die_history(0.9, 8e-5)
    _, fine = die_history(0.45, 8e-5)
    assert window.plan.substeps >= 4
    assert coarse < 0.02
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.5)


def test_energy_budget_of_a_two_scale_run_balances():
    window, _ = die_history(0.9, 4e-5)
    sums = energy_sums(window.macro, 1.0) + energy_sums(window.meso, -1.0)
    balance = EnergyBalance(limit=0.02, trivial=0.0)
    energies = balance.judge(sums, 4e-5)
    assert energies["external"] > 0
    assert balance.balance_error < 0.01
    assert balance.force_residual < 1e-12
    assert abs(energies["interface"]) < 0.01 * energies["external"]
