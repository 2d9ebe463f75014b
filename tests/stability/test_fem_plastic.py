"""Explicit runs with plastic flow, large rotations and impact: energy balance and stability."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.bodies import SOLDER
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.cases.hard.trials.motion import energies_of, explicit, imbalance, rod
from reflowshock.fem.errors import InvertedElementError
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.materials.library import FR4
from reflowshock.materials.parameters import Isotropic, JohnsonCook

both_formulations = pytest.mark.parametrize("formulation", ["one_point", "incompatible_modes"])


@both_formulations
def test_bar_pulled_at_ten_thousand_a_second_balances(formulation):
    """Strain up to 10 %, with hardening, rate dependence and waves of the initial velocity field."""
    body, motion = explicit(rod(10e-3, 2e-3, (20, 2)), SOLDER, "finite", formulation, 0.6)
    motion.velocity[:, 0] = np.where(body.free[:, 0], 1e4 * body.local.points[:, 0], 0.0)
    energies = energies_of(motion, round(2e-5 / motion.step))
    assert imbalance(energies) < 1e-3
    assert np.all(np.diff(energies[:, 2]) >= 0)
    stretch = np.ptp(body.local.points[:, 0] + motion.displacement[:, 0]) / 10e-3
    assert 1.08 < stretch < 1.12
    assert energies[-1, 2] > 0.8 * (energies[0, 0] - energies[-1, 0])


@both_formulations
def test_elastic_plastic_impact_balances(formulation):
    """A rod strikes a wall at 60 m/s, with small and finite strains and skewed elements, without a gain of energy."""

    def skew(points: np.ndarray) -> np.ndarray:
        return points + np.outer(points[:, 1], [0.0, 0.0, 0.8])

    for finite in (False, True):
        body, motion = explicit(
            rod(6e-3, 1e-3, (18, 3), skew), SOLDER, "finite" if finite else "small", formulation, 0.6
        )
        motion.velocity[:, 0] = np.where(body.free[:, 0], -60.0, 0.0)
        energies = energies_of(motion, 400)
        assert imbalance(energies) < 1e-3
        assert energies[-1, 2] > 0.05 * energies[0].sum()


def test_hundred_turns_keep_energy_and_momentum():
    """A free brick of FR4 rotates a hundred times: energy and momentum are conserved, no strain accumulates."""
    points, cells = grid([0, 1e-3, 2e-3], [0, 1e-3], [0, 1e-3])
    body, motion = explicit(mesh_of(points, cells, "board", {}), FR4, "finite", "one_point", 0.9)
    rate = 0.02 / motion.step * np.array([0.6, 0.0, 0.8])
    centred = body.local.points - body.mass @ body.local.points / body.mass.sum()
    motion.velocity[:] = np.cross(rate, centred)

    def spin() -> np.ndarray:
        velocity = 0.5 * (motion.velocity + motion._following_velocity())
        return body.mass @ np.cross(centred + motion.displacement, velocity)

    start = [motion.kinetic_energy(), *spin()]
    steps, strains = round(100 * 2 * np.pi / 0.02), []
    for step in range(steps):
        motion.advance()
        motion.update_force()
        if step % 500 == 0:
            strains.append(motion.internal_energy().total)
    assert np.abs(spin() - start[1:]).max() < 1e-9 * np.abs(start[1:]).max()
    held = motion.internal_energy()
    assert motion.kinetic_energy() + held.total == pytest.approx(start[0], rel=1e-3)
    assert max(strains[-10:]) < 1.5 * max(strains[:10])


def test_inverted_element_ends_the_run_with_its_name():
    body, motion = explicit(rod(4e-3, 1e-3, (4, 1)), SOLDER, "finite", "one_point", 0.9)
    tip = body.local.points[:, 0] > 3.9e-3
    motion.velocity[tip, 0] = -1.2e-3 / motion.step
    with pytest.raises(InvertedElementError, match=r"element \d+, at first near"):
        energies_of(motion, 2)


def taylor_mesh(radius: float, length: float, across: int, along: int) -> MeshData:
    """Return a quarter cylinder along z by mapping squares to circles: axis at x = y = 0, foot at z = 0."""
    line = np.linspace(0, 1, across + 1)
    points, cells = grid(line, line, np.linspace(0, length, along + 1))
    largest, norm = points[:, :2].max(axis=1), np.linalg.norm(points[:, :2], axis=1)
    factor = 1.0 + largest * (largest / np.where(norm > 0, norm, 1.0) - 1.0)
    points[:, :2] *= radius * factor[:, None]
    return mesh_of(points, cells, "board", {"symmetry_x": on(0, 0.0), "symmetry_y": on(1, 0.0)})


@both_formulations
def test_copper_rod_that_strikes_a_rigid_wall(formulation):
    """Taylor impact of copper at 227 m/s: final length 21.3 to 21.6 mm, foot radius 6.8 to 7.3 mm in published codes.

    Radius 3.2 mm, length 32.4 mm, sigma_y = 400 MPa, E_p = 100 MPa (Zhu & Cescotto, IJNME 38, 1995, and their tables).
    """
    copper = Isotropic(
        density=8930.0, young_modulus=117e9, poisson_ratio=0.35, plasticity=JohnsonCook(A=400e6, B=100e6, n=1.0)
    )
    body, motion = explicit(taylor_mesh(3.2e-3, 32.4e-3, 3, 24), copper, "finite", formulation, 0.25)
    foot = np.abs(body.local.points[:, 2]) < 1e-9
    for node in np.flatnonzero(foot):
        motion.hold(np.array([node]), 2)
    motion.velocity[~foot, 2] = -227.0
    first = motion.kinetic_energy()
    while motion.time < 80e-6:
        motion.advance()
        motion.update_force()
    held, position = motion.internal_energy(), body.local.points + motion.displacement
    assert motion.kinetic_energy() + held.total == pytest.approx(first, rel=1e-3)
    assert 6.8e-3 < np.linalg.norm(position[foot, :2], axis=1).max() < 7.7e-3
    assert held.hourglass < 0.01 * held.total
    assert position[:, 2].max() == pytest.approx(21.45e-3, rel=0.015)
