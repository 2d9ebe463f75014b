"""Galerkin space and equations of the scheme ispg, and the spectrum of its linearised step."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import null_space

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import box_cloud, joint_cloud, sphere_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.discretisation.lagged_cholesky import LaggedCholesky
from reflowshock.particles.gripc.collocation import collocate
from reflowshock.particles.gripc.gripc_step import force_pressure
from reflowshock.particles.ispg.galerkin_equations import LiquidProperties
from reflowshock.particles.ispg.galerkin_space import GalerkinSpace
from reflowshock.particles.ispg.ispg_step import IspgStep
from reflowshock.particles.ispg.moving_plates import FloatingModes
from reflowshock.particles.ispg.nodal_volumes import body_moments
from reflowshock.particles.ispg.rigid_motions import rigid_momenta, rigid_motions
from reflowshock.particles.ispg.state import find_centre
from reflowshock.particles.ispg.stencils import DegenerateStencil
from reflowshock.particles.ispg.step_kernels import projected
from reflowshock.particles.ispg.wall_forces import StepSolution, WallForces
from reflowshock.particles.physics.forces import SurfaceTension
from reflowshock.particles.physics.operators import Inertia, Mass
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.physics.plate_motion import LIFT, SHIFT, Floating
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.relaxation import Relaxation
from reflowshock.particles.steps.time_step import TimeStep


def shaken(cloud):
    """Return a body whose particles off the walls are displaced from the lattice."""
    body = Body.at_rest(cloud)
    shake = np.random.default_rng(5).uniform(-0.15, 0.15, cloud.points.shape) * cloud.spacing
    body.points = cloud.points + np.where((cloud.wall < 0)[:, None], shake, 0.0)
    return body


@pytest.fixture(scope="module")
def body():
    """Return a cube on a wall with inner particles moved at random."""
    return shaken(box_cloud(1.0, 6))


@pytest.fixture(scope="module")
def space(body):
    """Return the shape functions at the particles of the body."""
    return GalerkinSpace.of(body)


def test_linear_velocities_along_the_wall_are_exact(body, space):
    slope = np.array([[0.3, -0.7, 0.0], [0.2, 0.5, 0.0], [0.0, 0.0, -0.8]])
    velocity = body.points @ slope.T + [1.0, -2.0, 0.0]
    gradient = space.gradient(velocity)
    assert space.unresolved(velocity) == pytest.approx(0.0, abs=1e-9)
    assert gradient == pytest.approx(np.broadcast_to(slope, gradient.shape), abs=1e-9)
    assert space.divergence(body.points @ slope.T) == pytest.approx(0.0, abs=1e-9)


def test_loads_are_transposes(body, space):
    """Virtual power: f . (v - N v), of viscous stress and of p div v."""
    random = np.random.default_rng(3)
    field, force = random.normal(size=(2, len(body.points), 3))
    other, factor = random.normal(size=(len(body.points), 3)), random.normal(size=len(body.points))
    stress = factor[:, None, None] * (space.gradient(other) + space.gradient(other).transpose(0, 2, 1))
    viscous = space.resistance(other, np.column_stack((0.0 * factor, 0.0 * factor, factor)))
    assert (viscous * field).sum() == pytest.approx((stress * space.gradient(field)).sum())
    assert ((force - space.distribute(force)) * field).sum() == pytest.approx((force * space.unresolved(field)).sum())
    assert (space.divergence_load(factor) * field).sum() == pytest.approx(factor @ space.divergence(field))


def test_volumes_have_the_moments_of_the_body(body, space):
    """Second moments are soft: their error is small for particles that fill the body evenly."""
    volume, first, second = body_moments(body)
    assert volume == pytest.approx(body.volume()[0])
    assert space.volumes.sum() == pytest.approx(volume)
    assert space.volumes @ body.points == pytest.approx(first)
    soft = 0.02 * volume * body.cloud.spacing**2
    assert (body.points * space.volumes[:, None]).T @ body.points == pytest.approx(second, abs=soft)
    assert space.volumes.min() > 0.0


def test_particles_of_a_thin_film_keep_their_volumes():
    """The film is one spacing thick; with exact moments the smallest volume would be 4e-4 of the mean."""
    film = Body.at_rest(box_cloud(1.0, 6))
    inner = (film.cloud.wall < 0) & (np.arange(len(film.points)) >= film.cloud.surface_count)
    above = film.points[:, 2] > 0.5
    film.points = film.points * [1.0, 1.0, 0.2]
    film.points[inner, 2] = 0.1 + np.where(above, 0.072, -0.072)[inner]
    volumes = GalerkinSpace.of(film).volumes
    assert volumes.min() > 0.2 * volumes.mean()
    assert volumes @ film.points == pytest.approx(body_moments(film)[1])


def test_a_uniform_pressure_pushes_the_surface_only(body):
    """B^T 1 is the gradient of the enclosed volume in spite of nodal integration."""
    equations = IspgStep().prepare(body, water(), NeighbourList(1.0, 0.0)).equations(body, 1e-3)
    assert equations.pressure_forces(np.ones(len(body.points))) == pytest.approx(body.volume()[1], abs=1e-12)


def test_linear_velocities_have_the_energy_of_the_body(body):
    """Kinetic energy of a stretching motion, by the soft second moments."""
    equations = IspgStep().prepare(body, water(), NeighbourList(1.0, 0.0)).equations(body, 1e-3)
    second = np.diag(body_moments(body)[2])
    assert equations.kinetic_energy(body.points * [1.0, 1.0, -2.0]) == pytest.approx(
        0.5 * (second @ [1.0, 1.0, 4.0]), rel=2e-3
    )


def test_the_projection_keeps_the_volumes(ball):
    """The correction meets B v = 0, accelerates masses and surface, and has no resultant and no moment."""
    body = shaken_inside(ball)
    equations = IspgStep().prepare(body, water(), NeighbourList(1.0, 0.0)).equations(body, 0.1)
    start = np.random.default_rng(4).normal(size=body.points.shape)
    respond, none = equations.response(), np.zeros(0)
    push = equations.pressure_forces(equations.pressure_correction(start, 0.0, LaggedCholesky(), respond))
    change = respond(push, none)
    scale = np.abs(equations.volume_rates(start)).max()
    assert equations.volume_rates(start + change) == pytest.approx(0.0, abs=1e-4 * scale)
    resisted = equations.momentum(change) / 0.1 + 0.1 * equations.tension_stiffness(change)
    assert resisted == pytest.approx(push, abs=1e-11 * np.abs(push).max())
    assert np.abs(0.1 * equations.tension_stiffness(change)).max() > 0.1 * np.abs(push).max()
    lost = rigid_momenta(rigid_motions(body.points), equations.masses, change)
    assert lost == pytest.approx(0.0, abs=1e-10 * np.abs(push).sum())


@pytest.fixture(scope="module")
def between_plates():
    """Joint with a lower plate that moves along its normal and an upper one that lifts and tilts, and its equations."""
    joint = shaken(joint_cloud(JointGeometry(1.0, 1.0, 1.0), 3.0, 0.3))
    twists = {0: np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0]), 1: np.array([0.0, 0.0, -0.3, 0.1, 0.2, 0.0])}
    return joint, twists, IspgStep().prepare(joint, water(), NeighbourList(1.0, 0.0)).equations(joint, 1e-3, twists)


def test_walls_that_move_change_the_volume(between_plates):
    """Rates of volume sum to the rate of the body; a uniform motion of liquid and plates changes none."""
    joint, twists, equations = between_plates
    field = (
        equations.prescribed
        + np.random.default_rng(6).normal(size=joint.points.shape) * (joint.cloud.wall < 0)[:, None]
    )
    assert equations.volume_rates(field).sum() == pytest.approx((joint.volume()[1] * field).sum())
    together = dict.fromkeys(twists, np.array([0.1, -0.2, 0.3, 0.0, 0.0, 0.0]))
    equations = IspgStep().prepare(joint, water(), NeighbourList(1.0, 0.0)).equations(joint, 1e-3, together)
    uniform = np.broadcast_to(together[0][:3], joint.points.shape).copy()
    assert equations.volume_rates(uniform) == pytest.approx(0.0, abs=1e-12)
    assert equations.lost_power(uniform, uniform).viscous == pytest.approx(0.0, abs=1e-20)


def test_plates_do_the_work_that_liquid_gains(between_plates):
    """The power of the plates balances inertia, tension, viscosity and smoothing."""
    joint, twists, equations = between_plates
    before = np.random.default_rng(7).normal(size=joint.points.shape)
    before = projected(equations.admitted, before) + equations.prescribed
    equations = replace(equations, fluid=LiquidProperties(1.0, 0.1, 3.0))
    still, respond, none = np.zeros_like(before), equations.response(), np.zeros(0)
    after_friction = equations.velocity_after_friction(before, still)
    start = equations.prescribed + respond(
        equations.load_without_prescribed(equations.momentum(after_friction) / 1e-3), none
    )
    rate = float((joint.volume()[1] * start).sum())
    pressure = equations.pressure_correction(start, rate, LaggedCholesky(), respond)
    now = start + respond(equations.pressure_forces(pressure), none)
    solution = StepSolution(still, before, after_friction, now, pressure)
    power = WallForces.of(equations, solution).power(joint, twists)
    lost, inertia = equations.lost_power(after_friction, now), (now * equations.momentum(now - before)).sum() / 1e-3
    expansion = rate * float(pressure @ equations.space.volumes) / equations.space.volumes.sum()
    resisted = 1e-3 * float((now * equations.tension_stiffness(now)).sum())
    assert power + expansion == pytest.approx(inertia + resisted + lost.viscous + lost.smoothing, rel=1e-4)


def test_a_plate_without_edges_floats_along_its_normal_only(between_plates):
    """Without a pad edge only the lift remains as a mode; it moves the particles on the plate along its normal."""
    joint, _, equations = between_plates
    free = Floating(1, np.vstack([LIFT, SHIFT]), np.array([0.0, 0.0, -2.0]))
    parts = joint, equations.admitted, equations.masses, equations.space.drift_of
    modes = FloatingModes.of((free,), *parts)
    assert modes.twists.shape == (1, 2, 6)
    on_plate = joint.cloud.wall == 1
    lift = 1.0 / np.sqrt(equations.masses[on_plate].sum())
    assert modes.fields[0] == pytest.approx(np.outer(on_plate, [0.0, 0.0, lift]))
    assert modes.twists[0, 1] == pytest.approx([0.0, 0.0, lift, 0.0, 0.0, 0.0])
    assert modes.loads == pytest.approx(-2.0 * lift)
    assert FloatingModes.of((Floating(1, SHIFT, np.zeros(3)),), *parts) is None


def test_a_plate_that_floats_takes_its_share_of_the_pressure(between_plates):
    """With a floating plate the correction keeps the volumes, and its momentum change has no power in the result."""
    joint, _, _ = between_plates
    physics = replace(water(), motions=(Floating(1, LIFT, np.zeros(3)),))
    equations = IspgStep().prepare(joint, physics, NeighbourList(1.0, 0.0)).equations(joint, 1e-3)
    start = np.random.default_rng(9).normal(size=joint.points.shape)
    start = projected(equations.admitted, start) + equations.space.floating.along(start)
    respond = equations.response()
    pressure = equations.pressure_correction(start, 0.0, LaggedCholesky(), respond)
    field = start + respond(equations.pressure_forces(pressure), equations.ghost_pressure_forces(pressure))
    assert equations.volume_rates(field) == pytest.approx(0.0, abs=1e-4 * np.abs(equations.volume_rates(start)).max())
    change = equations.momentum(field - start)
    assert (change * field).sum() == pytest.approx(0.0, abs=1e-4 * np.abs((change * start).sum()))
    assert np.abs(equations.twists(field, [1])[1]).max() > 0.0


def test_the_pressure_operator_is_composed_of_its_parts(body, between_plates):
    """The operator is B times the response to B^T p, with implicit tension, walls and a floating plate."""
    joint, _, _ = between_plates
    lifts = replace(water(), motions=(Floating(1, LIFT, np.zeros(3)),))
    for drop, physics in ((body, water()), (joint, lifts)):
        equations = IspgStep().prepare(drop, physics, NeighbourList(1.0, 0.0)).equations(drop, 0.1)
        pressure, respond = np.random.default_rng(11).normal(size=len(drop.points)), equations.response()
        whole = respond(equations.pressure_forces(pressure), equations.ghost_pressure_forces(pressure))
        operator, _ = equations.pressure_equation(respond)
        expected = equations.volume_rates(whole)
        assert operator(pressure) == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())


def test_the_pressure_matrix_equals_its_operator(body, space):
    """The band holds the operator in single precision, scaled to a unit diagonal."""
    equations = IspgStep().prepare(body, water(), NeighbourList(1.0, 0.0)).equations(body, 1e-6)
    balanced, count = replace(equations, unbalanced=np.zeros_like(body.points)), len(body.points)
    operator, matrix = balanced.pressure_equation(balanced.response())
    band, order = matrix(), space.order
    assert band.rows[:, -1] == pytest.approx(1.0, abs=1e-6)
    width = band.rows.shape[1]
    assert width < count
    lower = np.zeros((count, width + count))
    for rank, row in enumerate(band.rows):
        lower[rank, rank + 1 : rank + 1 + width] = row
    whole = np.array([operator(unit) for unit in np.eye(count)])
    assert lower[:, :width] == pytest.approx(0.0, abs=0.0)
    assert lower[:, width:] / np.outer(band.scale[order], band.scale[order]) == pytest.approx(
        np.tril(whole[np.ix_(order, order)]), abs=1e-6 * np.abs(whole).max()
    )


def test_a_lonely_particle_is_named():
    lonely = shaken(box_cloud(1.0, 6))
    lonely.points[-1] += 7.0
    with pytest.raises(DegenerateStencil, match=f"particle {len(lonely.points) - 1} at .* fewer than 16"):
        GalerkinSpace.of(lonely)


def water(inertia=True):
    """Return the physics of a liquid with unit density and surface tension."""
    tension = SurfaceTension(1.0)
    return Physics((tension,), (Mass(1.0), tension), (Inertia(1.0),) if inertia else (), (), ())


@pytest.fixture(scope="module")
def ball():
    """Ball of 147 particles at rest."""
    rest = Body.at_rest(sphere_cloud(4.0 / 3.0 * np.pi, 3))
    flow = LiquidFlow(rest, water(inertia=False), TimeStep(10.0, rest.cloud.spacing, 10.0), Relaxation(1.0))
    for _ in range(30):
        flow.step()
    return rest


def stiffness(ball):
    """Return minus the derivative of the forces at constant pressure by finite differences, shape (3 n, 3 n)."""
    count, size = ball.cloud.surface_count, 3 * len(ball.points)
    slope, tension = ball.volume()[1][:count], water()
    pressure = -(tension.force(ball)[:count] * slope).sum() / (slope**2).sum()

    def force(points):
        moved = replace(ball, points=points)
        return (tension.force(moved) + pressure * moved.volume()[1]).ravel()

    matrix = np.zeros((size, size))
    for column in range(3 * count):
        step = np.zeros(size)
        step[column] = 1e-5
        shift = step.reshape(-1, 3)
        matrix[:, column] = -(force(ball.points + shift) - force(ball.points - shift)) / 2e-5
    return 0.5 * (matrix + matrix.T)


def shaken_inside(ball):
    """Return the ball with displaced particles below its surface, which stays at rest."""
    shake = np.random.default_rng(1).uniform(-0.1, 0.1, ball.points.shape) * ball.cloud.spacing
    shake[: ball.cloud.surface_count] = 0.0
    return replace(ball, points=ball.points + shake)


def test_no_mode_of_the_linearised_scheme_grows(ball):
    """Squared frequencies of m v' = -K x + B^T p, x' = v, B v = 0 are positive, and 8 for the second mode.

    A mode is weighted by its share of the divergence-free linear velocities; grid modes have almost none.
    """
    body = shaken_inside(ball)
    equations = IspgStep().prepare(body, water(), NeighbourList(1.0, 0.0)).equations(body, 1e-3)
    units = np.eye(body.points.size).reshape(-1, *body.points.shape)
    root = np.repeat(equations.masses, 3) ** -0.5
    free = null_space(np.array([equations.volume_rates(unit) for unit in units]).T * root, rcond=1e-9)
    squares, modes = np.linalg.eigh(free.T @ (root[:, None] * stiffness(body) * root) @ free)
    assert squares.min() > -1e-8
    shears = [np.eye(3)[:, [k]] * np.eye(3)[k - 1] for k in range(3)]
    slopes = [np.diag([1.0, -1.0, 0.0]), np.diag([1.0, 1.0, -2.0]), *shears]
    swings = np.linalg.qr(np.array([(body.points @ (slope + slope.T)).ravel() / root for slope in slopes]).T)[0]
    share = ((modes.T @ free.T @ swings) ** 2).sum(axis=1)
    assert share.sum() == pytest.approx(5.0, abs=1e-3)
    near = (squares > 7.0) & (squares < 9.0)
    assert share[near].sum() > 4.7
    assert share @ squares / 5.0 == pytest.approx(8.0, rel=0.02)


def test_a_swing_keeps_its_momenta(ball):
    """With uneven particles and large steps the implicit tension has no moment."""
    body = shaken_inside(replace(ball, points=ball.points @ np.diag([1.2, 0.9, 0.8])))
    flow = LiquidFlow(body, water(), TimeStep(0.3, body.cloud.spacing, 0.3), IspgStep())
    for _ in range(12):
        flow.step()
    motions, state = rigid_motions(flow.body.points), flow.solver.state
    size = np.sqrt(2.0 * state.kinetic * np.array([(motion**2).sum(axis=1).mean() for motion in motions]))
    assert state.kinetic > 0.05
    assert state.momenta / size == pytest.approx(0.0, abs=1e-6)  # tolerance of the linear solver


def test_a_swing_keeps_its_centre(ball):
    """Mesh smoothing transfers volume from one side to another, which must not move the centre."""
    body = shaken_inside(replace(ball, points=ball.points @ np.diag([1.2, 0.9, 0.8])))
    flow = LiquidFlow(body, water(), TimeStep(0.3, body.cloud.spacing, 0.3), IspgStep())
    start = find_centre(body)
    for _ in range(40):
        flow.step()
    flow.solver.prepare(flow.body, water(), flow.neighbours)
    assert find_centre(flow.body) == pytest.approx(start, abs=1e-4 * body.cloud.spacing)


def test_a_zigzag_of_the_surface_dies_away(ball):
    """The shape functions hardly resolve the zigzag; with particles that move with N v, 98 % of it remained."""
    body = shaken_inside(ball)
    equations = IspgStep().prepare(body, water(), NeighbourList(1.0, 0.0)).equations(body, 1e-3)
    count, zigzag = body.cloud.surface_count, np.zeros_like(body.points)
    normals = body.volume()[1][:count]
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    signs = np.linalg.svd(equations.space.shape.toarray()[:count, :count])[2][-1]
    zigzag[:count] = signs[:, None] * normals
    resolved = zigzag - equations.space.unresolved(zigzag)
    assert np.abs((resolved[:count] * normals).sum(axis=1)).max() < 0.1 * np.abs(signs).max()
    height = 0.02 * body.cloud.spacing / np.abs(signs).max()

    def moved(displacement):
        flow = LiquidFlow(replace(body, points=body.points + displacement), water(), time_step(body), IspgStep())
        for _ in range(20):
            flow.step()
        return flow.body.points

    left = moved(height * zigzag) - moved(0.0 * zigzag)
    assert abs((left * zigzag).sum()) < 0.3 * height


def time_step(body):
    """Return a time step control that hardly changes the step."""
    return TimeStep(0.1, body.cloud.spacing, 0.1)


@pytest.mark.parametrize("basis", ["linear", "quadratic"])
def test_modes_of_the_collocated_scheme_grow(ball, basis):
    """Eigenvalues of x'' = -grad p, lap p = 0 with collocated operators and prescribed surface pressure."""
    body, count = shaken_inside(ball), ball.cloud.surface_count
    size = body.points.size
    boundary = np.zeros((len(body.points), size))
    for column in range(3 * count):
        step = np.zeros(size)
        step[column] = 1e-5
        ends = [force_pressure(replace(body, points=body.points + s * step.reshape(-1, 3)), water()) for s in (1, -1)]
        boundary[:count, column] = (ends[0] - ends[1]) / 2e-5
    operators = collocate(body.points, (), body.cloud.spacing, basis)
    poisson = operators.laplacian.toarray()
    poisson[:count] = operators.values.toarray()[:count]
    pressure = np.linalg.solve(poisson, boundary)
    slope = np.stack([part @ pressure for part in operators.gradient], axis=1).reshape(size, size)
    growth = np.sqrt(np.linalg.eigvals(-slope).astype(complex)).real
    assert growth.max() > 0.05
