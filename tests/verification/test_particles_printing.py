"""Printed ink on cured ink: a drop on a flat cured slab becomes the same spherical cap as on a plate."""

import numpy as np
import pytest
import pyvista

from reflowshock.particles.flows.droplet import cap
from reflowshock.particles.flows.printing import Printing, PrintingNumerics
from reflowshock.particles.printing.deposit import SOLID, CuredBody, Deposit
from reflowshock.particles.sph import flow
from reflowshock.particles.surface.level_set import measure_depths

LAYERS = 5


def on_slab(degrees):
    """Return a 23 um drop, 8 particles across, after landing at 3 m/s on a cured slab, and the slab top [m]."""
    scene = Printing(
        drop_volume=6.37e-15, surface_tension=0.072, viscosity=0.0149, speed=3.0, delay=1.0, pitch=23e-6, columns=1,
        rows=1, layers=3, contact_angle=np.radians(degrees), numerics=PrintingNumerics(particles_per_diameter=8),
    )  # fmt: skip
    deposit = Deposit(scene)
    spacing = deposit.law.spacing
    half = int(np.ceil(1.3 * scene.length / spacing))
    across, up = spacing * (np.arange(-half, half) + 0.5), spacing * (np.arange(LAYERS) + 0.5)
    points = np.stack(np.meshgrid(across, across, up, indexing="ij")).reshape(3, -1)
    count, top = points.shape[1], LAYERS * spacing
    deposit.fields = flow.make_fields(points, np.empty((3, 0)), np.zeros(count), deposit.law)
    deposit.state, deposit.drop = np.full(count, SOLID, np.int32), np.zeros(count, np.int32)
    deposit.dose = np.zeros(count)
    deposit._add_body(CuredBody(*open_box(half * spacing, top), 0))
    deposit.add_drop((0.0, 0.0))
    return scene, deposit, top


def open_box(half, top):
    """Return the surface of a box without its bottom, oriented outwards."""
    box = pyvista.Box((-half, half, -half, half, 0.0, top)).triangulate().clean()
    points, triangles = np.array(box.points, dtype=float), box.faces.reshape(-1, 4)[:, 1:].astype(np.int32)
    return points, triangles[points[triangles, 2].max(axis=1) > 0.5 * top]


def errors_on_slab(degrees, units):
    """Return errors of height and profile radius over base radius against the cap; time in sqrt(rho D^3 / gamma).

    At 8 particles per diameter the base, extrapolated from 1.5 spacings, is 9 % too narrow on the plate as well,
    where the profile is accurate within 2 %.
    """
    scene, deposit, top = on_slab(degrees)
    unit = np.sqrt(scene.density * scene.length**3 / scene.surface_tension)
    while deposit.time < units * unit:
        deposit.step(1.0)
    points = deposit.surface.points - [0.0, 0.0, top]
    half, height = np.array(cap(scene.contact_angle)) * scene.length * [0.5, 1.0]
    sphere = (half**2 + height**2) / (2.0 * height)
    read = (points[:, 2] > 0.5 * deposit.law.spacing) & (points[:, 2] < 0.9 * height)
    exact = np.sqrt(sphere**2 - (points[read, 2] - height + sphere) ** 2)
    radius = np.linalg.norm(points[read, :2], axis=1)
    assert deposit.simulation.kinetic_energy < 1e-3 * np.pi * scene.length**2 * scene.surface_tension
    return points[:, 2].max() / height - 1.0, (radius - exact).mean() / half


@pytest.mark.long
def test_a_drop_on_cured_ink_has_the_contact_angle_of_one_on_the_plate():
    height, profile = errors_on_slab(90.0, 1.5)
    assert abs(height) < 0.05 and abs(profile) < 0.05  # as on the plate; 0.18 and 0.2 without wall fractions


def test_liquid_that_spreads_on_cured_ink_stays_within_its_surface():
    scene, deposit, _ = on_slab(90.0)
    while deposit.time < 0.5 * np.sqrt(scene.density * scene.length**3 / scene.surface_tension):
        deposit.step(1.0)
    deposit.update()
    inside = measure_depths(deposit.points[deposit.liquid], deposit.surface.points, deposit.surface.triangles)
    assert inside.min() > -0.2 * deposit.law.spacing  # before the surface had an image in cured ink: -0.7


@pytest.mark.long
@pytest.mark.parametrize(("degrees", "units"), [(60.0, 4.0), (120.0, 3.0)])
def test_drops_on_cured_ink_that_they_wet_or_not(degrees, units):
    height, profile = errors_on_slab(degrees, units)
    assert abs(height) < 0.04 and abs(profile) < 0.04
