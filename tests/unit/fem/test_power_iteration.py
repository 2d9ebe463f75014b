"""The highest frequency of an assembled, tied model against dense eigenvalues, as an upper bound."""

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import dns_body
from reflowshock.fem.mesh.mesh import append
from reflowshock.fem.model.power_iteration import highest_frequency, margin_after, random_normal, steps_for
from tests.support.fem_bodies import dense_stiffness
from tests.support.fem_models import bar, small_assembly

BODIES = {
    "bar": bar(0.01, 5, 1e-3),
    "assembly": append(small_assembly(1, size=1e-3)),
}


@pytest.mark.parametrize("name", BODIES)
def test_estimate_is_just_above_the_largest_eigenvalue(name):
    body, element_step = dns_body(BODIES[name])
    mass = np.where(body.mass > 0, body.mass, np.inf)
    scale = np.where(body.free, 1 / np.sqrt(mass)[:, None], 0).ravel()
    exact = 2 / np.sqrt(np.linalg.eigvalsh(scale[:, None] * dense_stiffness(body) * scale)[-1])
    estimate = highest_frequency(MPI.COMM_SELF, body, body.terms, body.mass)
    assert element_step < exact
    assert estimate.critical_step <= exact * (1 + 1e-12)
    assert estimate.critical_step >= exact * (1 - 0.003)
    assert estimate.iterations < 240


def test_model_that_cannot_move_has_no_critical_step():
    body, _ = dns_body(bar(0.01, 2, 1e-3))
    body.free[:] = False
    assert np.isinf(highest_frequency(MPI.COMM_SELF, body, body.terms, body.mass).critical_step)


def test_margin_and_steps_are_inverse():
    assert margin_after(steps_for(10**6, 0.005), 10**6) == pytest.approx(0.005, rel=0.02)


def test_random_start_is_normal_and_depends_on_node_numbers_alone():
    nodes = np.arange(20000)
    values = random_normal(nodes)
    assert np.array_equal(random_normal(nodes[::-7]), values[::-7])
    assert abs(values.mean()) < 0.02
    assert values.std() == pytest.approx(1.0, abs=0.02)
    assert (values**4).mean() == pytest.approx(3.0, abs=0.15)
    assert np.abs(np.corrcoef(values.T) - np.eye(3)).max() < 0.02
