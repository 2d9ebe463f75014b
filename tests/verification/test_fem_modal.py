"""Natural frequencies against exact values (bar, beam, plates, free body) and the measured mode of the JEDEC board."""

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import dns_body
from reflowshock.cases.hard.trials.grids import grid, mesh_of
from reflowshock.fem.dynamics import modal
from reflowshock.fem.dynamics.modal import natural_modes
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.global_matrix import Equations
from reflowshock.materials.library import FR4
from tests.support.fem_bodies import STEEL
from tests.support.fem_models import bar

SPEED = np.sqrt(STEEL.young_modulus / STEEL.density)  # bar wave speed; nu = 0
WIDTH = 0.1


def equations(body: Body) -> Equations:
    """Return the equations of a body on one rank."""
    return Equations.of(MPI.COMM_SELF, body)


def frequencies(body: Body, count: int) -> np.ndarray:
    """Return the lowest natural frequencies of a body, shape (count,) [Hz]."""
    return natural_modes(equations(body), count).frequency


def held_bar(elements: int, held_at_end: tuple[int, ...]) -> Body:
    """Return a bar with some displacement components held at its end."""
    body, _ = dns_body(bar(WIDTH, elements, 1e-3), STEEL)
    end = body.local.points[:, 0] < 1e-9
    body.free[np.ix_(end, held_at_end)] = False
    return body


def test_bar():
    """A bar fixed at one end has the axial frequencies (2 k - 1) c / 4 L."""
    body = held_bar(40, (0,))
    body.free[:, 1:] = False
    exact = np.array([1, 3, 5]) * SPEED / (4 * WIDTH)
    assert frequencies(body, 3) == pytest.approx(exact, rel=0.01)


def test_cantilever_beam():
    """Euler-Bernoulli modes appear twice because the section is square."""
    exact = np.array([1.875104, 4.694091]) ** 2 / (2 * np.pi * WIDTH**2) * SPEED * 1e-3 / np.sqrt(12)
    assert frequencies(held_bar(40, (0, 1, 2)), 4) == pytest.approx(np.repeat(exact, 2), rel=0.01)


def quarter_plate(elements: int, thickness: float, held: tuple[tuple[int, ...], tuple[int, ...]]) -> Body:
    """Return a quarter of a square plate, symmetric about x = 0 and y = 0, with components fixed on the other sides."""
    side = np.linspace(0, WIDTH / 2, elements + 1)
    points, cells = grid(side, side, [0, thickness])
    body, _ = dns_body(mesh_of(points, cells, "board", {}), STEEL)
    x, y = body.local.points[:, 0], body.local.points[:, 1]
    for coordinate, value, components in ((x, 0, (0,)), (y, 0, (1,)), (x, 0.05, held[0]), (y, 0.05, held[1])):
        body.free[np.ix_(np.isclose(coordinate, value), components)] = False
    return body


def plate_frequency(factor: float, thickness: float) -> float:
    """Return factor / (2 pi a^2) sqrt(D / rho h) [Hz] of a square plate, nu = 0."""
    return factor / (2 * np.pi * WIDTH**2) * SPEED * thickness / np.sqrt(12)


def test_simply_supported_square_plate():
    """Navier: pi^2 (m^2 + n^2), m and n odd; deflection and tangential displacement are zero on the sides."""
    body = quarter_plate(16, 1e-3, ((1, 2), (0, 2)))
    exact = [plate_frequency(np.pi**2 * factor, 1e-3) for factor in (2, 10, 10)]
    assert frequencies(body, 3) == pytest.approx(exact, rel=0.01)


def test_clamped_square_plate():
    """Young, J. Appl. Mech. 17, 1950: 35.99 for the first mode; 131.64 and 132.25 with two more half waves."""
    body = quarter_plate(16, 1e-3, ((0, 1, 2), (0, 1, 2)))
    exact = [plate_frequency(factor, 1e-3) for factor in (35.99, 131.64, 132.25)]
    assert frequencies(body, 3) == pytest.approx(exact, rel=0.01)


@pytest.fixture(scope="module")
def free_body() -> Body:
    """Return a bar without supports."""
    points, cells = grid(np.linspace(0, WIDTH, 21), np.linspace(0, 0.01, 3), np.linspace(0, 2e-3, 3))
    return dns_body(mesh_of(points, cells, "board", {}), STEEL)[0]


def test_free_body_moves_rigidly_in_its_six_lowest_modes(free_body):
    modes = natural_modes(equations(free_body), 8)
    exact = 4.730041**2 / (2 * np.pi * WIDTH**2) * SPEED * 2e-3 / np.sqrt(12)
    assert modes.frequency[:6].max() < 1e-3 * exact
    assert modes.frequency[6] == pytest.approx(exact, rel=0.01)
    mass = free_body.mass.sum()
    assert modes.effective_mass[:6].sum(axis=0) == pytest.approx(mass * np.ones(3), rel=1e-6)
    assert modes.effective_mass[6:].max() < 1e-9 * mass


def test_shapes_are_orthonormal_and_carry_the_stiffness(free_body):
    modes = natural_modes(equations(free_body), 8)
    flat = modes.shape.reshape(8, -1)
    assert flat @ (np.repeat(free_body.mass, 3)[:, None] * flat.T) == pytest.approx(np.eye(8), abs=1e-8)
    force = np.zeros_like(modes.shape[6])
    for term in free_body.terms:
        term.add(modes.shape[6], force)
    inertia = (2 * np.pi * modes.frequency[6]) ** 2 * free_body.mass[:, None] * modes.shape[6]
    assert np.abs(force + inertia).max() < 1e-6 * np.abs(inertia).max()


@pytest.mark.skipif(modal.SLEPc is None, reason="SciPy is all there is")
def test_frequencies_equal_scipy(free_body, monkeypatch):
    with_slepc = natural_modes(equations(free_body), 9)
    monkeypatch.setattr(modal, "SLEPc", None)
    with_scipy = natural_modes(equations(free_body), 9)
    assert with_scipy.frequency[6:] == pytest.approx(with_slepc.frequency[6:], rel=1e-6)
    overlap = np.einsum("kni,n,kni->k", with_scipy.shape, free_body.mass, with_slepc.shape)
    assert np.abs(overlap[6:]) == pytest.approx(np.ones(3), abs=1e-6)


def test_first_mode_of_the_jedec_board():
    """The JESD22-B111 board of FR4, fixed at its four holes, was measured at 280 Hz (Fuchs & Major 2011)."""
    points, cells = grid(np.linspace(0, 66e-3, 34), np.linspace(0, 38.5e-3, 20), [0, 1e-3])
    body, _ = dns_body(mesh_of(points, cells, "board", {}), FR4)
    x, y = body.local.points[:, 0], body.local.points[:, 1]
    body.free[x < 1e-9, 0] = False
    body.free[y < 1e-9, 1] = False
    body.free[np.hypot(x - 52.5e-3, y - 35.5e-3) < 1.5e-3] = False
    assert 200.0 < frequencies(body, 1)[0] < 350.0


@pytest.mark.parametrize("count", [0, 100000])
def test_number_of_modes_out_of_range(free_body, count):
    with pytest.raises(ValueError, match=r"number of modes = .*; allowed: 1 to"):
        natural_modes(equations(free_body), count)
