"""Droplets by delta-SPH in space: mirror, surface and its forces, start, restart, bad input to the surface."""

import numba
import numpy as np
import pytest

from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.flows.droplet import Droplet, DropletNumerics, cap
from reflowshock.particles.flows.droplet_metrics import base_width, outcome
from reflowshock.particles.flows.flow_effects import decide_flow
from reflowshock.particles.scenes.products import read_flow, write_flow
from reflowshock.particles.sph import flow
from reflowshock.particles.sph.capillary_forces import (
    Capillarity,
    contact_cosines,
    divide_by_sliding_velocity,
    line_normals,
)
from reflowshock.particles.sph.liquid_surface import LiquidSurface
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.sph_flows.droplet import droplet, mean_width, solve_droplet
from reflowshock.particles.surface.remeshing import is_folded
from reflowshock.particles.surface.surface_mesh import SurfaceLost, SurfaceMesh

INK = {"diameter": 1.0, "density": 1.0, "surface_tension": 1.0, "viscosity": 0.2, "duration": 0.02}
COARSE = DropletNumerics(particles_per_diameter=8)


def drop(**changes):
    """Return the parameters of a coarse droplet; ``changes`` replace them."""
    return Droplet(**INK | {"numerics": COARSE} | changes)


def test_a_drop_has_its_volume_and_its_surface_encloses_it():
    for scene in (drop(), drop(start="cube"), drop(contact_angle=1.0), drop(speed=3.0)):
        simulation = droplet(scene)
        volume = (simulation.fields.mass / simulation.fields.density).sum()
        assert volume == pytest.approx(scene.volume, rel=1e-12)
        assert simulation.surface.volume == pytest.approx(scene.volume, rel=1e-4)
        assert simulation.fields.z.min() > 0.0 or not scene.has_wall


def test_a_half_sphere_starts_with_its_contact_line_on_the_wall_and_loses_energy_from_then_on():
    """If part of the line starts above the wall, the volume is 3 % too large."""
    simulation = droplet(drop(contact_angle=0.5 * np.pi))
    surface = simulation.surface
    assert not any(surface.points[ring, 2].any() for ring in surface.mesh.rings)
    energy = surface.energy
    for _ in range(3):
        simulation.step(simulation.time_step())
    assert surface.volume == pytest.approx(simulation.fluids * simulation.law.spacing**3, rel=1e-3)
    assert simulation.kinetic_energy + surface.energy < (1.0 + 1e-4) * energy


def test_a_surface_whose_sheets_have_crossed_is_worn():
    surface, spacing = droplet(drop()).surface, 0.125
    points, triangles = surface.points, surface.triangles
    for distance, folded in ((1.5, False), (0.5, True)):
        both = np.concatenate((points, points + [distance, 0.0, 0.0]))
        assert is_folded(both, np.concatenate((triangles, triangles + len(points))), spacing) == folded
    assert is_folded(points, triangles[:, ::-1], spacing)


def test_forces_of_the_surface_are_minus_the_gradient_of_its_energy_at_its_pressure():
    surface = droplet(drop(contact_angle=1.0)).surface
    forces, random = surface.forces(), np.random.default_rng(5)
    direction = random.normal(size=surface.points.shape)
    for ring in surface.mesh.rings:
        direction[ring, 2] = 0.0
    step, start, pressure = 1e-6, surface.points.copy(), surface.pressure
    energies = []
    for sign in (1.0, -1.0):
        surface.mesh.points = start + sign * step * direction
        energies.append(surface.energy - pressure * surface.volume)
    surface.mesh.points = start
    work = -(energies[0] - energies[1]) / (2.0 * step)
    assert work == pytest.approx((forces * direction).sum(), rel=1e-6)
    free = droplet(drop()).surface
    assert np.abs(free.forces().sum(axis=0)).max() < 1e-12


def test_a_sphere_of_liquid_rests_under_the_pressure_of_its_surface():
    """Tension and pressure nearly cancel on an uneven triangulation, and particles do not drift."""
    scene = drop()
    simulation = droplet(scene)
    surface = simulation.surface
    forces, pull = surface.forces(), surface.pressure * np.linalg.norm(surface.mesh.outward_areas(), axis=1)
    assert surface.pressure == pytest.approx(scene.laplace_pressure, rel=0.01)
    assert simulation.pressures == pytest.approx(surface.pressure)
    assert np.linalg.norm(forces, axis=1).mean() < 0.1 * pull.mean()
    crowd = np.linalg.norm(simulation.rates[7:10], axis=0) * simulation.law.length
    without = Simulation(simulation.fields, simulation.fluids, simulation.law).rates[7:10] * simulation.law.length
    assert crowd.max() < 0.5 * np.linalg.norm(without, axis=0).max()


def test_forces_that_particles_share_keep_momentum_and_work():
    simulation = droplet(drop())
    surface, fields = simulation.surface, simulation.fields
    rates = np.zeros((10, simulation.fluids))
    surface.add_to(rates, fields, simulation.fluids)
    total = rates[1:4] @ fields.mass
    assert np.abs(total).max() < 1e-12 * np.abs(surface.forces()).sum()
    velocity = np.random.default_rng(2).normal(size=(3, simulation.fluids))
    before = surface.points.copy()
    surface.move(velocity, 1e-3, scene_volume := surface.volume)
    moved = (surface.points - before) / 1e-3
    surface.mesh.points = before
    work = (surface.forces() * moved).sum()
    assert work == pytest.approx((rates[1:4] * velocity * fields.mass).sum(), rel=1e-9)
    assert scene_volume > 0.0


def test_a_mirror_does_what_images_would():
    """Half of a body of liquid above a mirror has the rates of the whole body."""
    spacing = 0.1
    places = np.arange(-5, 5) + 0.5
    points = spacing * np.stack(np.meshgrid(places, places, places, indexing="ij")).reshape(3, -1)
    upper = points[2] > 0.0
    random = np.random.default_rng(8)
    shift, speed = random.uniform(-0.02, 0.02, (3, upper.sum())), random.normal(0.0, 1.0, (3, upper.sum()))
    density = random.uniform(0.99, 1.01, upper.sum())
    above = points[:, upper] + shift
    law = flow.law_of(drop(), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), has_surface=True)
    flip = np.array([[1.0], [1.0], [-1.0]])

    def rates(liquid, velocities, densities, mirror):
        chosen = flow.law_in_space(law, spacing, mirror=mirror, no_slip=False)
        fields = flow.make_fields(liquid, np.empty((3, 0)), np.zeros(liquid.shape[1]), chosen)
        fields.u[:], fields.v[:], fields.w[:] = velocities
        fields.density[:] = densities
        simulation = Simulation(fields, liquid.shape[1], chosen)
        return Simulation(simulation.fields, liquid.shape[1], chosen).rates  # slopes of the first are in the second

    half = rates(above, speed, density, True)
    whole = rates(
        np.concatenate((above, flip * above), axis=1),
        np.concatenate((speed, flip * speed), axis=1), np.tile(density, 2), False,
    )  # fmt: skip
    assert np.abs(half - whole[:, : upper.sum()]).max() < 1e-10 * np.abs(whole).max()


def test_a_tank_in_space_rests_under_its_weight():
    """In a periodic layer on a mirror the pressure is hydrostatic within 2 %."""
    spacing, deep = 0.1, 12
    places, heights = np.arange(8) + 0.5, np.arange(deep) + 0.5
    points = spacing * np.stack(np.meshgrid(places, places, heights, indexing="ij")).reshape(3, -1)
    scene = drop(viscosity=0.02)
    law = flow.law_of(scene, (0.8, 0.8, 0.0), (0.0, 0.0, -1.0), has_surface=True)
    law = flow.law_in_space(law, spacing, mirror=True, no_slip=False)._replace(sound=15.0)
    depth = spacing * deep - points[2]
    simulation = Simulation(flow.make_fields(points, np.empty((3, 0)), depth, law), points.shape[1], law)
    errors = []
    while simulation.time < 1.0:
        simulation.step(simulation.time_step())
        errors.append(simulation.fields.pressure - (spacing * deep - simulation.fields.z))
    late = np.mean(errors[len(errors) // 2 :], axis=0) / (spacing * deep)
    assert np.abs(late).mean() < 0.02
    assert simulation.fastest < 0.05


def test_widths_of_a_cap_are_found():
    for degrees in (45.0, 90.0, 130.0):
        angle = np.radians(degrees)
        base, height = cap(angle)
        radius = base / (2.0 * np.sin(angle))
        z = np.random.default_rng(1).uniform(0.0, height, 4000)
        across = np.sqrt(radius**2 - (z - height + radius) ** 2)
        turn = np.random.default_rng(2).uniform(0.0, 2.0 * np.pi, 4000)
        points = np.stack((across * np.cos(turn), across * np.sin(turn), z), axis=1)
        assert base_width(points, 0.05) == pytest.approx(base, rel=0.01)
        assert mean_width(points) == pytest.approx(
            2.0 * radius * (np.sin(angle) if angle < np.pi / 2 else 1.0), rel=0.01
        )
    assert np.isnan(base_width(points[:3], 0.05))


def test_liquid_that_left_its_surface_is_refused():
    simulation = droplet(drop())
    surface = simulation.surface
    mesh = SurfaceMesh(surface.points + 5.0, surface.triangles, surface.law.spacing, has_wall=False)
    lost = LiquidSurface(mesh, Capillarity(1.0, 0.0, surface.law))
    with pytest.raises(SurfaceLost, match="left its surface"):
        lost.add_to(simulation.rates, simulation.fields, simulation.fluids)


def test_a_surface_without_particles_ends_the_run_in_words(monkeypatch):
    def tear(self, time_step):
        self.steps = 7
        raise SurfaceLost("torn")

    monkeypatch.setattr(Simulation, "step", tear)
    with pytest.raises(SurfaceLost, match=r"step 7, .* units of time: torn; .*more particles per diameter"):
        solve_droplet(drop(speed=3.0))


def test_an_impact_wets_the_wall_and_its_surface_can_be_made_anew():
    simulation = droplet(drop(speed=3.0))
    surface = simulation.surface
    assert not surface.mesh.rings
    while simulation.time < 0.15:
        simulation.step(simulation.time_step())
    assert len(surface.mesh.rings) == 1
    area, volume = surface.wetted_area, surface.volume
    assert area > 0.1
    surface.remeshing.rebuild(surface.mesh, "worn", surface.capillarity.energy)
    assert surface.remeshing.rebuilds == 1
    assert surface.wetted_area == pytest.approx(area, rel=0.2)  # a foot of a spacing is closed, of 8 across
    assert surface.volume == pytest.approx(volume, rel=0.03)
    simulation.step(simulation.time_step())
    assert simulation.fields.z.min() >= 0.0


@pytest.mark.long
def test_a_drop_that_does_not_wet_its_wall_rebounds():
    scene = drop(weber=4.0, reynolds=300.0, contact_angle=np.radians(150.0), gravity=0.0)
    unit = np.sqrt(scene.density * scene.diameter**3 / scene.surface_tension)
    result = solve_droplet(scene.model_copy(update={"duration": 1.4 * unit}))
    assert outcome(result.history) == "rebounds"
    assert 0.8 * unit < result.metrics["contact_time"][0] < 1.4 * unit
    up = result.pictures[-1].velocity[:, 2].mean()
    assert 0.2 * scene.impact_speed < up < scene.impact_speed
    assert result.pictures[-1].points[:, 2].min() > 0.0


@pytest.mark.parametrize(
    ("foot", "parts", "shed", "words"),
    [
        ((0.0, 0.0), 1, 0, "does not touch the wall"),
        ((0.0, 0.9), 1, 0, "stays on the wall"),
        ((0.9, 0.3), 2, 0, "a part rebounds"),
        ((0.9, 0.0), 3, 0, "rebounds in parts"),
        ((0.0, 0.9), 1, 2, "stays on the wall, sheds satellites"),
    ],
)
def test_outcome_of_an_impact_in_words(foot, parts, shed, words):
    history = {"foot": np.array(foot), "parts": np.array([1.0, parts]), "shed": np.array([0.0, shed])}
    assert outcome(history) == words


def test_fast_impacts_report_the_expected_spread():
    spread = solve_droplet(drop(weber=100.0, reynolds=1000.0, duration=1e-4)).words["spread_expected"]
    assert spread == "2.67 to 2.83 D by correlations of measured drops, 3.15 D by a correlation of computed drops"
    assert "spread_expected" not in solve_droplet(drop(weber=8.0, reynolds=7.7, duration=1e-4)).words


def test_a_wall_holds_a_contact_line_at_rest_and_one_that_moves_has_its_angle():
    outward, push = np.array([[2.0, 0.0], [0.0, 2.0]]), np.array([[0.6, 0.0], [0.0, -0.6]])
    held = contact_cosines(-0.5, 0.4, outward, push, np.zeros((2, 2)))
    assert held[:, 0] == pytest.approx([-0.3, 0.3])
    assert contact_cosines(-0.5, 0.4, outward, push, 0.1 * outward)[:, 0] == pytest.approx([-0.5, 0.1])
    assert contact_cosines(-0.5, 0.4, outward, push, -outward)[:, 0] == pytest.approx([0.4, 0.4])


@pytest.mark.parametrize("across", [8, 12])
def test_friction_takes_less_than_the_velocity_of_a_contact_line_in_a_step(across):
    """With weights W, masses m, lengths L: dv/dt = -gamma W / m W^T L v / v_sliding; full removal is unstable."""
    numerics = DropletNumerics(particles_per_diameter=across)
    simulation = droplet(drop(contact_angle=0.5 * np.pi, advancing_angle=2.0, numerics=numerics))
    simulation.step(simulation.time_step())
    surface, (offsets, indices) = simulation.surface, simulation.surface.coupling.lists
    (ring,) = surface.mesh.rings
    shares = np.zeros((len(ring), len(simulation.fields.mass)))
    for row, vertex in zip(shares, ring, strict=True):
        pairs = slice(offsets[vertex], offsets[vertex + 1])
        row[indices[pairs]] = surface.coupling.shares[0, pairs]
    lengths = np.linalg.norm(line_normals(surface.points[ring]), axis=1)
    slowness = divide_by_sliding_velocity(np.ones((1, 3)), surface.tension, simulation.law)[0, 0]
    taken = surface.tension * slowness * (shares / simulation.fields.mass) @ shares.T * lengths
    assert 0.2 < simulation.time_step() * np.abs(np.linalg.eigvals(taken)).max() < 0.5


def test_threads_change_no_droplet(every_thread):
    results = []
    for threads in (1, every_thread):
        numba.set_num_threads(threads)
        simulation = droplet(drop(speed=3.0))
        for _ in range(15):
            simulation.step(simulation.time_step())
        results.append(np.array(simulation.fields[:8]))
    assert np.array_equal(*results)


def test_a_droplet_continues_to_the_same_bits(tmp_path):
    scene, steps = drop(speed=3.0, duration=0.08), []

    class Killed(Exception):
        pass

    def kill(done):
        steps.append(done)
        if len(steps) == 25:
            raise Killed

    whole = solve_droplet(scene)
    with pytest.raises(Killed):
        solve_droplet(scene, kill, Checkpoint(tmp_path / "drop", (scene,), interval=0.0))
    again = Checkpoint(tmp_path / "drop", (scene,), interval=0.0)
    continued = solve_droplet(scene, None, again)
    assert again.continued
    for name, column in whole.history.items():
        assert np.array_equal(column, continued.history[name], equal_nan=True), name
    write_flow(tmp_path, whole)
    assert read_flow(tmp_path).metrics["spread_max"] == whole.metrics["spread_max"]


def test_effects_of_a_droplet_follow_from_its_numbers():
    small = drop(diameter=1e-4, density=1e3, surface_tension=0.07, viscosity=1e-3, contact_angle=1.0)
    decisions = decide_flow(small)
    assert not decisions["droplet_gravity"]["on"] and decisions["droplet_tension"]["on"]
    large = small.model_copy(update={"diameter": 2e-3})
    assert decide_flow(large)["droplet_gravity"]["on"]
    assert not decide_flow(large.model_copy(update={"contact_angle": None}))["droplet_gravity"]["on"]
    fast = drop(weber=2e4, reynolds=100.0)
    assert not decide_flow(fast)["droplet_tension"]["on"]
    assert droplet(fast).surface.tension == 0.0
    assert fast.impact_speed == pytest.approx(np.sqrt(2e4))
    assert fast.reynolds_number == pytest.approx(100.0)
