"""Delta-SPH: kernels, sums over neighbours, walls, conservation, restarts and threads."""

import numba
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial import cKDTree

from reflowshock.data_file import fields_of
from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.flows.channel import Poiseuille
from reflowshock.particles.flows.dam_break import DamBreak, second_rise
from reflowshock.particles.flows.flow_effects import artificial_viscosity, decide_flow
from reflowshock.particles.flows.sph_numerics import SphNumerics
from reflowshock.particles.flows.vortices import TaylorGreen
from reflowshock.particles.reference.dam_break import MEASURED, measured_pressure
from reflowshock.particles.scenes.products import read_flow, write_flow
from reflowshock.particles.sph.flow import make_fields
from reflowshock.particles.sph.fluid_state import REPRODUCING
from reflowshock.particles.sph.particle_rates import condition_of, rates_of, solved
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.sph.smoothing import KERNELS, norm, shape, share_beyond_plane, slope
from reflowshock.particles.sph.threads import Rows
from reflowshock.particles.sph_flows.dam_break import dam, solve_dam_break
from reflowshock.particles.sph_flows.viscous_flows import channel, solve_poiseuille, vortices

AREAS = {1: lambda q: 2.0, 2: lambda q: 2.0 * np.pi * q, 3: lambda q: 4.0 * np.pi * q * q}


def small_dam(**changes):
    """Return a dam break of few particles; ``changes`` replace parameters."""
    parameters = {"height": 0.6, "width": 1.2, "tank_length": 3.22, "sensor_height": 0.12, "duration": 0.02}
    return DamBreak(**parameters | changes, numerics=SphNumerics(particles_across=10))


@pytest.mark.parametrize("dimension", [1, 2, 3])
@pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS.keys())
def test_kernels_integrate_to_one_and_their_slope_is_their_derivative(kernel, dimension):
    line = dimension == 1
    sigma = norm(kernel, dimension, 1.0)
    integral = sum(
        quad(lambda q: sigma * shape(kernel, line, q) * AREAS[dimension](q), a, a + 1.0)[0] for a in (0.0, 1.0)
    )
    assert integral == pytest.approx(1.0, abs=1e-6)
    for q in (0.3, 0.999999, 1.000001, 1.7):
        difference = (shape(kernel, line, q + 1e-6) - shape(kernel, line, q - 1e-6)) / 2e-6
        assert slope(kernel, line, q) * q == pytest.approx(difference, abs=1e-6)
    assert shape(kernel, line, 2.0) == 0.0
    assert shape(kernel, line, 1.0 - 1e-9) == pytest.approx(shape(kernel, line, 1.0 + 1e-9), abs=1e-8)


@pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS.keys())
def test_the_kernel_beyond_a_plane_is_that_of_a_lattice_behind_it(kernel):
    line = (np.arange(-40, 40) + 0.5) / 20.0
    x, y, z = np.meshgrid(line, line, line, indexing="ij")
    radius = np.sqrt(x * x + y * y + z * z).ravel()
    levels = norm(kernel, 3, 1.0) / 20.0**3 * np.array([shape(kernel, False, ratio) for ratio in radius[radius < 2.0]])
    planes = np.array([0.0, 0.2, 0.7, 1.5, 2.0])
    sums = [levels[z.ravel()[radius < 2.0] > plane].sum() for plane in planes]
    assert share_beyond_plane(kernel, planes) == pytest.approx(sums, abs=2e-3)
    assert share_beyond_plane(kernel, planes[[0, -1]]) == pytest.approx([0.5, 0.0], abs=1e-5)


def test_walls_list_the_liquid_alone_and_the_liquid_all():
    law = dam(small_dam()).law
    points, fluids = np.random.default_rng(5).uniform(0.0, 6.0 * law.length, (300, 3)), 100
    liquid_rows, all_rows = Rows(law, fluids), Rows(law, 300)
    liquid_rows.update(points.T)
    all_rows.update(points.T)
    for i in range(300):
        mine, every = liquid_rows.of(i), all_rows.of(i)
        assert sorted(mine) == sorted(every if i < fluids else every[every < fluids])
        assert not np.diff((mine < fluids).astype(int)).max(initial=-1) > 0  # the liquid comes first


def test_periodic_neighbours_are_those_of_a_tree_of_the_torus():
    law = vortices(TaylorGreen(side=1.0, speed=1.0, viscosity=10.0, numerics=SphNumerics(particles_across=12))).law
    points = np.random.default_rng(3).uniform(-1.0, 2.0, (400, 3)) * np.array([1.0, 0.0, 1.0])
    rows = Rows(law, 400)
    rows.update(points.T)
    reach = 2.3 * law.length
    wrapped = points[:, [0, 2]] % 1.0
    pairs = cKDTree(wrapped, boxsize=1.0).query_ball_point(wrapped, reach)
    for i, near in enumerate(pairs):
        assert sorted(near) == sorted(rows.of(i).tolist())


def disturbed(simulation: Simulation) -> Simulation:
    """Return the simulation with random disturbances of positions, velocities and densities."""
    random, fields = np.random.default_rng(7), simulation.fields
    for axis in (fields.x, fields.z):
        axis += random.uniform(-0.2, 0.2, axis.shape) * simulation.law.spacing
    for speed in (fields.u, fields.w):
        speed += random.normal(0.0, 0.1, speed.shape) * simulation.law.sound / 10.0
    fields.density[:] *= 1.0 + random.normal(0.0, 0.01, fields.density.shape)
    return Simulation(fields, simulation.fluids, simulation.law)


@pytest.mark.parametrize("kernel", KERNELS)
def test_without_walls_momentum_stays_to_rounding(kernel):
    numerics = SphNumerics(particles_across=16, kernel=kernel, artificial_viscosity=0.1)
    simulation = disturbed(vortices(TaylorGreen(side=1.0, speed=1.0, density=1.0, viscosity=0.01, numerics=numerics)))
    fields, scale = simulation.fields, np.abs(simulation.rates[1:4]).max()
    force = simulation.rates[1:4] @ fields.mass[: simulation.fluids]
    assert np.abs(force).max() < 1e-12 * scale * fields.mass.sum()
    before = np.array([fields.mass @ fields.u, fields.mass @ fields.w])
    for _ in range(20):
        simulation.step(simulation.time_step())
    after = np.array([fields.mass @ fields.u, fields.mass @ fields.w])
    assert np.abs(after - before).max() < 1e-12 * fields.mass.sum()


def test_the_gradient_of_a_linear_density_is_exact_and_does_not_diffuse():
    simulation = vortices(TaylorGreen(side=1.0, speed=1.0, density=1.0, viscosity=0.01))
    law = simulation.law._replace(period_x=0.0, period_z=0.0, viscosity=0.0)
    fields, random = simulation.fields, np.random.default_rng(1)
    for axis in (fields.x, fields.z):
        axis += random.uniform(-0.2, 0.2, axis.shape) * law.spacing
    for quiet in (fields.u, fields.w):
        quiet[:] = 0.0
    fields.density[:] = 1.0 + 0.01 * fields.x - 0.02 * fields.z
    fields.slope_x[:], fields.slope_z[:] = 0.01, -0.02
    rows = Rows(law, simulation.fluids)
    rows.update(fields[:3])
    inner = np.flatnonzero((np.abs(fields.x - 0.5) < 0.3) & (np.abs(fields.z - 0.5) < 0.3))
    for i in inner[::7]:
        rates = rates_of(np.uint64(i), simulation.fluids, rows.of(i), fields, law)
        assert rates[4:7] == pytest.approx((0.01, 0.0, -0.02), abs=1e-12)
        assert abs(rates[0]) < 1e-12 * law.sound / law.length
    assert solved((1e-3, 0.0, 1e-3, 0.0, 0.0, 0.0), (1.0, 0.0, 1.0), 2) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_reproducing_gradient_is_exact_for_linear_densities_at_surfaces_and_corners(dimension):
    law = dam(small_dam()).law
    length = 1.3 * law.spacing
    law = law._replace(
        dimension=dimension, length=length, norm=norm(law.kernel, dimension, length), gradient=REPRODUCING
    )
    depth = 6 if dimension == 3 else 1
    lattice = np.stack(np.meshgrid(*(np.arange(count) for count in (6, depth, 6)), indexing="ij")).reshape(3, -1)
    moved = np.random.default_rng(2).uniform(-0.2, 0.2, lattice.shape) * (np.array([1.0, depth > 1, 1.0])[:, None])
    slopes = np.array([3.0, 5.0 if dimension == 3 else 0.0, -7.0])
    fields = make_fields(law.spacing * (lattice + moved), np.empty((3, 0)), np.zeros(lattice.shape[1]), law)
    fields.density[:] += slopes @ np.array(fields[:3])
    rows = Rows(law, lattice.shape[1])
    rows.update(fields[:3])
    for i in range(lattice.shape[1]):
        rates = rates_of(np.uint64(i), lattice.shape[1], rows.of(i), fields, law)
        assert rates[4:7] == pytest.approx(tuple(slopes), abs=1e-9)
    alone = rates_of(np.uint64(0), lattice.shape[1], rows.of(0)[:3], fields, law)
    assert alone[4:7] == (0.0, 0.0, 0.0)  # too few neighbours


@pytest.mark.parametrize("dimension", [2, 3])
def test_condition_numbers_are_bounded(dimension):
    for seed in range(20):
        half = np.random.default_rng(seed).normal(size=(dimension, dimension))
        axes, matrix = [0, 2] if dimension == 2 else [0, 1, 2], np.zeros((3, 3))
        matrix[np.ix_(axes, axes)] = half @ half.T
        moments = (matrix[0, 0], matrix[1, 1], matrix[2, 2], matrix[0, 1], matrix[1, 2], matrix[0, 2])
        exact = np.linalg.cond(half @ half.T)
        assert exact <= condition_of(moments, dimension) * (1.0 + 1e-9) < 30.0 * exact
    assert condition_of((1.0, 0.0, 0.0, 0.0, 0.0, 0.0), dimension) == np.inf


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_moments_are_solved_in_the_directions_of_the_flow(dimension):
    random = np.random.default_rng(dimension)
    axes = {1: [0], 2: [0, 2], 3: [0, 1, 2]}[dimension]
    matrix = np.zeros((3, 3))
    half = random.normal(size=(dimension, dimension))
    matrix[np.ix_(axes, axes)] = half @ half.T + np.eye(dimension)
    gradient = np.zeros(3)
    gradient[axes] = random.normal(size=dimension)
    sums = matrix @ gradient
    moments = (matrix[0, 0], matrix[1, 1], matrix[2, 2], matrix[0, 1], matrix[1, 2], matrix[0, 2])
    assert solved(moments, tuple(sums), dimension) == pytest.approx(tuple(gradient), abs=1e-12)


def test_walls_carry_liquid_at_rest():
    simulation = dam(small_dam(width=3.2))
    fields, liquid = simulation.fields, slice(simulation.fluids)
    depth = 0.6 - fields.z[liquid]
    inner = (depth > 3 * simulation.law.spacing) & (np.abs(fields.x[liquid] - 1.6) < 1.0)
    assert np.abs(simulation.rates[3][inner]).max() < 0.05 * 9.81  # bottom layer; 1 % above
    below = fields.z[simulation.fluids :] < 0.0
    assert fields.pressure[simulation.fluids :][below].max() > 0.9 * 1000.0 * 9.81 * 0.6


def test_walls_do_not_slip_where_viscosity_acts():
    simulation = channel(Poiseuille(width=1e-3, speed=0.01))
    fields = simulation.fields
    fields.u[: simulation.fluids] = 0.01 * fields.z[: simulation.fluids] / 1e-3
    again = Simulation(fields, simulation.fluids, simulation.law)
    lower = fields.z < 0.0
    assert (again.fields.u[lower] <= 0.0).all()
    assert again.fields.u[lower].min() < -1e-4
    assert not fields.wall_u.any()


def test_threads_change_nothing(every_thread):
    results = []
    for threads in (1, every_thread):
        numba.set_num_threads(threads)
        simulation = disturbed(dam(small_dam()))
        for _ in range(5):
            simulation.step(simulation.time_step())
        results.append(np.array(simulation.fields[:8]))
    assert np.array_equal(*results)


def test_a_flow_continues_to_the_same_bits(tmp_path, monkeypatch):
    scene = small_dam()
    whole = solve_dam_break(scene)
    steps = []

    class Killed(Exception):
        pass

    def kill(done):
        steps.append(done)
        if len(steps) == 30:
            raise Killed

    checkpoint = Checkpoint(tmp_path / "flow", (scene,), interval=0.0)
    with pytest.raises(Killed):
        solve_dam_break(scene, kill, checkpoint)
    again = Checkpoint(tmp_path / "flow", (scene,), interval=0.0)
    continued = solve_dam_break(scene, None, again)
    assert again.continued
    assert all(np.array_equal(whole.history[name], continued.history[name]) for name in whole.history)
    for expected, actual in zip(whole.pictures, continued.pictures, strict=True):
        assert all(np.array_equal(value, fields_of(actual)[name]) for name, value in fields_of(expected).items())


def test_a_flow_is_read_as_it_was_written(tmp_path):
    result = solve_poiseuille(
        Poiseuille(width=1e-3, speed=0.01, duration=0.01, numerics=SphNumerics(particles_across=8))
    )
    write_flow(tmp_path, result)
    read = read_flow(tmp_path)
    assert [picture.time for picture in read.pictures] == [picture.time for picture in result.pictures]
    assert read.history.keys() == result.history.keys()
    assert np.array_equal(read.walls, result.walls)
    assert "seconds" not in read.metrics
    points = np.concatenate([picture.points for picture in read.pictures])
    assert points[:, 0].min() >= 0.0 and points[:, 0].max() <= 1.25e-3


def test_viscosity_acts_where_its_layer_is_thick_and_the_artificial_one_elsewhere():
    water = decide_flow(small_dam())
    assert (water["flow_viscosity"]["on"], water["artificial_viscosity"]["on"]) == (False, True)
    syrup = small_dam(viscosity=10.0)
    assert decide_flow(syrup)["flow_viscosity"]["on"]
    assert artificial_viscosity(syrup) == 0.0
    assert decide_flow(small_dam(effects={"viscosity": "on"}))["flow_viscosity"]["on"]


def test_the_second_rise_of_what_was_measured_is_found():
    measured = measured_pressure(2.0, 5.366, 0.2)
    assert measured is not None and len(measured[0]) == len(MEASURED)
    assert measured_pressure(1.0, 5.366, 0.2) is None
    time = np.linspace(0.0, 7.3, 2000)
    pressure = np.interp(time, *measured)
    assert second_rise(time, pressure) == pytest.approx(5.7, abs=0.1)
    assert np.isnan(second_rise(time[:1500], pressure[:1500]))
