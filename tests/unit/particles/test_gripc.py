"""Parts of the published scheme against exact fields and published sums."""

import numpy as np
import pytest
from scipy import sparse

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.discretisation.incompressibility import SolveFailed
from reflowshock.particles.gripc.collocation import collocate
from reflowshock.particles.gripc.gripc_step import GripcStep, force_pressure, viscous_pressure
from reflowshock.particles.gripc.projection import (
    Material,
    Poisson,
    Velocities,
    correct_pressure,
    smooth_velocities,
    solve_gmres,
)
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.physics.forces import SurfaceTension
from reflowshock.particles.physics.operators import Mass
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.physics.plate_motion import PlateMotion
from reflowshock.particles.scenes.flow_setup import start_flow
from reflowshock.particles.steps.rest import SchemeUnstable, StopRule, run_to_rest
from reflowshock.particles.surface.contact_line import ContactLine


@pytest.fixture(scope="module")
def box():
    """Return the particles of a cube on a wall."""
    return box_cloud(1.0, 6)


@pytest.fixture(scope="module")
def operators(box):
    """Return the quadratic operators at the particles of the cube."""
    return collocate(box.points, box.plates, box.spacing, "quadratic")


def test_smoothing_equals_the_printed_sum():
    """The twin evaluates eq 28 for one particle at a time."""
    random = np.random.default_rng(2)
    shape, old, new, retained = random.normal(size=(4, 4)), *random.normal(size=(3, 4))
    result = smooth_velocities(Velocities(old, retained), new, sparse.csr_matrix(shape))
    for j in range(4):
        change = sum(shape[j, i] * (new[i] - old[i]) for i in range(4))
        end = sum(shape[j, i] * new[i] for i in range(4))
        assert result.unsmoothed[j] == pytest.approx(0.5 * (retained[j] + change) + 0.5 * end)
    assert result.coefficients is new


@pytest.mark.parametrize("basis", ["linear", "quadratic"])
def test_a_uniform_slip_is_not_smoothed_away(box, basis):
    uniform = np.repeat([2.0, -1.0, 0.0], len(box.points))
    smoothing = collocate(box.points, box.plates, box.spacing, basis).smoothing
    assert smooth_velocities(Velocities(uniform, uniform), uniform, smoothing).unsmoothed == pytest.approx(uniform)


def test_the_corrected_pressure_is_given_on_the_surface(box, operators):
    """Eqs 5 and 22: p_new = phi + p - mu div v*, equal to the given pressure on the surface."""
    random = np.random.default_rng(6)
    divergence, pressure, boundary = random.normal(size=(3, len(box.points)))
    surface = np.arange(len(box.points)) < box.surface_count
    result = correct_pressure(
        Poisson(operators, surface, "quadratic"), Material(3.0, 0.2), divergence, pressure, boundary
    )
    assert result.pressure[surface] == pytest.approx(boundary[surface], abs=1e-6)
    assert result.pressure == pytest.approx(result.potential + pressure - 0.2 * divergence, abs=1e-9)
    assert (operators.laplacian @ result.potential)[~surface] == pytest.approx(3.0 * divergence[~surface], abs=1e-5)


def test_a_failed_solve_tells_its_residual():
    singular = sparse.csr_matrix(np.array([[1.0, 1.0], [1.0, 1.0]]))
    with pytest.raises(SolveFailed, match="residual"):
        solve_gmres(singular, np.array([1.0, -1.0]), "quadratic")


def test_viscous_pressure_of_an_even_strain(box):
    """The viscous pressure is 2 mu n . grad v . n, the normal strain on the faces of a cube."""
    body, strain = Body.at_rest(box), np.diag([-0.5, -1.5, 2.0])
    gradient = np.broadcast_to(strain[:, :, None], (3, 3, len(box.points)))
    result = viscous_pressure(body, 0.3, gradient)
    inside = np.abs(box.points[: box.surface_count] - [0.0, 0.0, 0.5])
    for axis in range(3):
        face = (inside[:, axis] > 0.49) & (np.delete(inside, axis, 1) < 0.45).all(axis=1)
        face &= box.wall[: box.surface_count] < 0
        assert face.any()
        assert result[face] == pytest.approx(0.6 * strain[axis, axis])


def test_an_edge_bears_what_is_left_on_a_held_vertex(box):
    """On a pinned line the pressure is the mean of the neighbours, without the balance within the wall."""
    body = Body.at_rest(box)
    ring = box.rings[0]
    line = ContactLine.__new__(ContactLine)
    line.wall, line.state = 0, np.zeros(len(ring), np.int8)
    tension = SurfaceTension(0.5)
    result = force_pressure(body, Physics((tension,), (tension,), (), (), (line,)))
    amid = np.abs(box.points[ring, :2]).min(axis=1) < 0.2
    assert amid.any()
    assert result[ring[amid]] == pytest.approx(0.0, abs=1e-9)
    assert result[: box.surface_count].max() > 1.0


def test_plates_that_move_are_refused(box):
    body = Body.at_rest(box)
    neighbours = NeighbourList(2.0 * box.spacing, 0.0)
    physics = Physics((), (Mass(1.0),), (), (), (), (PlateMotion.__new__(PlateMotion),))
    with pytest.raises(ValueError, match="plates at rest"):
        GripcStep("quadratic").prepare(body, physics, neighbours)


def test_the_end_of_the_printed_scheme_says_why(monkeypatch):
    """Every failure is reported with its reason, including a division by zero."""
    solder = Solder(volume=1e-9, numerics=SolderNumerics(scheme="gripc", time_step_limit=0.5))
    effects = {"gravity": False, "inertia": True, "viscosity": True, "surface_tension": True, "wall_adhesion": False}
    printed = start_flow(box_cloud(1e-3, 5), solder, effects, ())
    other = start_flow(box_cloud(1e-3, 5), Solder(volume=1e-9), effects, ())
    for flow in (printed, other):
        monkeypatch.setattr(flow, "step", lambda: 1 // 0)
    with pytest.raises(SchemeUnstable, match=r"step 1 at time 0 s: .*strong form.*\"ispg\".*ZeroDivisionError"):
        run_to_rest(printed, StopRule(10, 1e-6, 1.0))
    with pytest.raises(SolveFailed, match=r"step 1 at time 0 s: .*division.*; try a smaller spacing"):
        run_to_rest(other, StopRule(10, 1e-6, 1.0))


def test_walls_let_fluid_slip(box):
    """A shear flow along the wall has zero divergence and viscous force there at any amplitude."""
    operators = collocate(box.points, (Plate.horizontal(0.0),), box.spacing, "quadratic")
    shear = np.concatenate((np.full(len(box.points), 3.0), np.zeros(2 * len(box.points))))
    assert operators.divergence @ shear == pytest.approx(0.0, abs=1e-9)
    assert operators.velocity_laplacian @ shear == pytest.approx(0.0, abs=1e-7)
