import numpy as np
import pytest
from scipy import sparse

from particles.approximate_projection import project
from particles.body import Body
from particles.cloud import box_cloud
from particles.incompressibility import SaddlePoint
from particles.neighbours import NeighbourList
from particles.parameters import Solder, SolderEffects, SolderNumerics
from particles.pressure_laplacian import pressure_laplacian
from particles.sessile import solve_drop


def shaken_body(count):
    cloud = box_cloud(1.0, count)
    body = Body.at_rest(cloud)
    rng = np.random.default_rng(17)
    body.points[cloud.surface_count :] += rng.uniform(-0.1, 0.1, (len(body.interior), 3)) * cloud.spacing
    neighbours = NeighbourList(2.4 * cloud.spacing, 0.2 * cloud.spacing)
    neighbours.update(body.points)
    return body, neighbours


def plain_laplacian(body, support):
    """The same sum, pair by pair."""
    first, points = body.cloud.surface_count, body.points
    square = ((points[:, None] - points[None]) ** 2).sum(axis=2)
    weight = np.where(square < support**2, (1.0 - square / support**2) ** 3, 0.0)
    np.fill_diagonal(weight, 0.0)
    scale = body.volumes / (weight * square).sum(axis=1)
    edge = 3.0 * weight * (scale[:, None] + scale)
    return (np.diag(edge.sum(axis=1)) - edge)[first:, first:]


def test_laplacian_equals_its_plain_twin():
    body, neighbours = shaken_body(5)
    found = pressure_laplacian(body, neighbours).toarray()
    assert found == pytest.approx(plain_laplacian(body, neighbours.radius), abs=1e-14)
    assert np.array_equal(found, found.T)


def test_laplacian_of_a_quadratic_pressure():
    """-V times the Laplacian of x^2 + y^2 + z^2 is -6 V, in the mean over particles far from the boundary."""
    body, neighbours = shaken_body(13)
    below = body.points[body.interior]
    inner = (np.abs(below - [0.0, 0.0, 0.5]) < 0.25).all(axis=1)
    found = (pressure_laplacian(body, neighbours) @ (below**2).sum(axis=1))[inner]
    assert found.mean() == pytest.approx(-6.0 * body.volumes[body.interior][inner].mean(), rel=0.02)


def test_solution_equals_the_dense_solution():
    """Six surface degrees of freedom that A couples, the rest diagonal; the last row is the volume."""
    rng = np.random.default_rng(5)
    size, surface, rows = 40, 6, 12
    root = rng.normal(size=(surface, surface))
    a = np.diag(rng.uniform(1.0, 2.0, size))
    a[:surface, :surface] += root @ root.T
    c = rng.normal(size=(rows + 1, size))
    c[-1, surface:] = 0.0
    compact = np.diag(np.full(rows, 8.0)) - np.ones((rows, rows)) * 0.2
    f, g = rng.normal(size=size), rng.normal(size=rows + 1)
    leak = np.zeros((rows + 1, rows + 1))
    leak[:-1, :-1] = compact
    leak -= c[:, surface:] @ np.diag(1.0 / np.diag(a)[surface:]) @ c[:, surface:].T
    expected = np.linalg.solve(np.block([[a, -c.T], [c, leak]]), np.concatenate((f, g)))
    problem = SaddlePoint(sparse.csr_matrix(a), sparse.csr_matrix(c), f, g)
    found = project(problem, sparse.csr_matrix(compact))
    assert np.concatenate((found.velocity, found.pressure)) == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("degrees", [60, 120])
def test_the_shape_at_rest_is_that_of_the_exact_divergence(degrees, monkeypatch):
    widths = []
    numerics = SolderNumerics(time_step_limit=100)
    solder = Solder(
        volume=1e-9, pad_contact_angle=np.radians(degrees), numerics=numerics, effects=SolderEffects(gravity="off")
    )
    for largest in (0, 2000):
        monkeypatch.setattr("particles.coupled_step.LARGEST_EXACT", largest)
        _, run = solve_drop(solder, 7)
        widths.append(run.profiles[-1].max_width)
        assert max(record.iterations for record in run.records) <= 15
    assert widths[0] == pytest.approx(widths[1], rel=1e-3)
