import numpy as np
import pytest

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.discretisation.lagged_multigrid import LaggedMultigrid
from reflowshock.particles.steps.potential_flow import LEAK, PotentialFlow
from reflowshock.particles.steps.relaxation import SUPPORT


def shaken_flow(count, seed=17):
    """Return a flow of a cube whose inner particles are moved at random."""
    cloud = box_cloud(1.0, count)
    body = Body.at_rest(cloud)
    off_wall = body.interior[cloud.wall[body.interior] < 0]
    rng = np.random.default_rng(seed)
    body.points[off_wall] += rng.uniform(-0.1, 0.1, (len(off_wall), 3)) * cloud.spacing
    neighbours = NeighbourList(SUPPORT * cloud.spacing, 0.2 * cloud.spacing)
    neighbours.update(body.points)
    return body, neighbours, PotentialFlow.of(body, neighbours)


def edges(body, support):
    """Return pair weights and weighted squared lengths, with images behind the wall z = 0, shape (n, n) each."""
    points, off = body.points, body.cloud.wall < 0
    weight, moment = np.zeros((2, len(points), len(points)))
    for image in (False, True):
        other = points * [1.0, 1.0, -1.0] if image else points
        square = ((points[:, None] - other[None]) ** 2).sum(axis=2)
        value = np.where(square < support**2, (1.0 - square / support**2) ** 3, 0.0)
        value *= np.outer(off, off) if image else 1.0
        np.fill_diagonal(value, 0.0)
        weight += value
        moment += value * square
    return weight, moment


def plain_laplacian(body, support):
    """Return the Laplacian of a body as a dense matrix, shape (n, n)."""
    weight, moment = edges(body, support)
    scale = body.volumes / moment.sum(axis=1)
    edge = 3.0 * weight * (scale[:, None] + scale)
    return (1.0 + LEAK) * np.diag(edge.sum(axis=1)) - edge


def test_laplacian_equals_its_plain_twin():
    body, neighbours, flow = shaken_flow(5)
    result = flow.laplacian.toarray()
    assert result == pytest.approx(plain_laplacian(body, neighbours.radius), abs=1e-14)
    assert np.array_equal(result, result.T)


def test_laplacian_of_a_quadratic_potential():
    """The mean of -V times the Laplacian of x^2 + y^2 + z^2 over inner particles is -6 V."""
    body, _, flow = shaken_flow(13)
    inner = (np.abs(body.points - [0.0, 0.0, 0.5]) < 0.25).all(axis=1)
    result = (flow.laplacian @ (body.points**2).sum(axis=1))[inner]
    assert result.mean() == pytest.approx(-6.0 * body.volumes[inner].mean(), rel=0.02)


def test_velocity_of_a_potential_that_is_even_at_the_wall_is_exact():
    """The gradient of phi = 2 x - y is (2, -1, 0) everywhere, with images at the wall."""
    body, _, flow = shaken_flow(7)
    result = flow.velocity(body.points @ np.array([2.0, -1.0, 0.0]))
    assert result == pytest.approx(np.tile([2.0, -1.0, 0.0], (len(result), 1)), abs=1e-7)


def test_velocity_of_a_stagnation_flow_converges():
    """For phi = x^2 + y^2 - 2 z^2 above the wall z = 0 the order is one on a jittered cloud."""
    errors = []
    for count in (9, 17):
        body, _, flow = shaken_flow(count)
        potential = body.points**2 @ np.array([1.0, 1.0, -2.0])
        inner = (np.abs(body.points[body.interior] - [0.0, 0.0, 0.2]) < 0.25).all(axis=1)
        exact = body.points[body.interior] * [2.0, 2.0, -4.0]
        errors.append(np.sqrt((((flow.velocity(potential) - exact)[inner]) ** 2).sum(axis=1).mean()))
    assert np.log2(errors[0] / errors[1]) > 0.8
    assert errors[0] < 0.02


def test_a_particle_apart_from_the_others_stays():
    body, neighbours, _ = shaken_flow(5)
    body.points[-1] += [0.0, 0.0, -2.0]
    neighbours.update(body.points)
    flow = PotentialFlow.of(body, neighbours)
    assert np.isfinite(flow.laplacian.data).all()
    assert (flow.velocity(body.points[:, 0])[-1] == 0.0).all()


def test_multigrid_is_reused_and_restored_to_the_same_bits():
    multigrid = LaggedMultigrid()
    rng = np.random.default_rng(3)
    for seed in (1, 2):
        _, _, flow = shaken_flow(9, seed)
        flux = rng.normal(size=flow.laplacian.shape[0])
        flux -= flux.mean()
        result, iterations = multigrid.solve(flow.laplacian, flux)
        assert iterations <= 15
        assert flow.laplacian @ result == pytest.approx(flux, abs=1e-4)
    first = multigrid.origin
    restored = LaggedMultigrid()
    restored.restore(multigrid.saved())
    again = [each.solve(flow.laplacian, 2.0 * flux + 1.0)[0] for each in (multigrid, restored)]
    assert np.array_equal(*again)
    assert multigrid.origin is first
