"""XSPH moves particles with a smoothed velocity and conserves momentum and centre of mass."""

import numpy as np
import pytest

from reflowshock.particles.flows.droplet import Droplet, DropletNumerics
from reflowshock.particles.sph import threads
from reflowshock.particles.sph.particle_rates import drift_of
from reflowshock.particles.sph_flows.droplet import droplet

INK = {"diameter": 23e-6, "density": 1000.0, "surface_tension": 0.072, "viscosity": 0.0149, "duration": 1e-5}


def ink(xsph, **changes):
    """Return a simulation of a small droplet with a factor of XSPH."""
    return droplet(Droplet(**INK | changes, numerics=DropletNumerics(particles_per_diameter=8, xsph=xsph)))


def drifts(simulation):
    """Return the additional velocity of XSPH of all liquid particles, shape (3, n) [m/s]."""
    velocities, rows = np.empty((3, simulation.fluids)), simulation.particles.rows
    for i in range(simulation.fluids):
        velocities[:, i] = drift_of(np.uint64(i), simulation.fluids, rows.of(i), simulation.fields, simulation.law)
    return velocities


def test_noise_is_smoothed_and_the_centre_of_mass_stays():
    simulation, random = ink(0.5), np.random.default_rng(4)
    fields = simulation.fields
    for speed in fields[3:6]:
        speed[:] = random.normal(size=simulation.fluids)
    fields.density[:] *= random.uniform(0.95, 1.05, simulation.fluids)
    drift = drifts(simulation)
    assert np.abs(drift @ fields.mass).max() < 1e-12 * np.abs(drift).max() * fields.mass.sum()
    assert np.std(fields.u + drift[0]) < 0.85 * np.std(fields.u)
    pairwise = np.zeros(3)  # sum over all pairs for one particle
    law, i = simulation.law, 40
    for j in range(simulation.fluids):
        q = np.linalg.norm([fields[k][i] - fields[k][j] for k in range(3)]) / law.length
        level = 1.0 - 1.5 * q * q * (1.0 - 0.5 * q) if q < 1.0 else 0.25 * max(2.0 - q, 0.0) ** 3
        weight = 0.5 * fields.mass[j] * level / (np.pi * law.length**3 * 0.5 * (fields.density[i] + fields.density[j]))
        pairwise += weight * np.array([fields[3 + k][j] - fields[3 + k][i] for k in range(3)])
    assert drift[:, i] == pytest.approx(pairwise, rel=1e-12)


def test_what_moves_as_a_whole_is_not_touched_and_beside_a_wall_the_image_counts():
    simulation = ink(0.5)
    simulation.fields.u[:] = 3.0
    assert not drifts(simulation).any()
    above = ink(0.5, contact_angle=1.5)
    above.fields.u[:], above.fields.w[:] = 3.0, -1.0
    drift, near = drifts(above), above.fields.z < above.law.length
    assert not drift[:2].any()  # along the wall the image has the same velocity
    assert (drift[2, near] > 0.0).all()  # across the wall it is reversed


@pytest.mark.long
def test_a_drop_rests_with_it_as_without_it():
    pair = [ink(xsph, start="cube") for xsph in (0.0, 0.5)]
    for simulation in pair:
        while simulation.time < 1.2e-5:
            simulation.step(simulation.time_step())
    widths = [np.ptp(simulation.surface.points, axis=0) for simulation in pair]
    assert widths[1] == pytest.approx(widths[0], rel=0.03)
    momentum = np.array([component @ simulation.fields.mass for component in simulation.fields[3:6]])
    assert np.abs(momentum).max() < 1e-10 * simulation.fields.mass.sum()


def test_where_it_is_off_no_loop_runs(monkeypatch):
    simulation = ink(0.0)
    monkeypatch.setattr(threads, "_find_drifts", None)
    simulation.step(1e-9)
