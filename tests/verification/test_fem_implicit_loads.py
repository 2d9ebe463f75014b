"""All loads and damping in implicit steps: energy balance to round-off, and the motion of explicit steps."""

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import dns_body, motion_of
from reflowshock.fem.dynamics.implicit import ImplicitMotion
from reflowshock.fem.dynamics.modal import natural_modes
from reflowshock.fem.dynamics.motion import Motion
from reflowshock.fem.loads.damping import RayleighDamping
from reflowshock.fem.loads.load import Load
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.global_matrix import Equations
from reflowshock.fem.parallel import checkpoint_state
from reflowshock.fem.problem.shock import Damping
from tests.support.fem_bodies import STEEL
from tests.verification.test_fem_loads import bar, largest_imbalance, loads_of

KINDS = ["pressure", "motion", "large_mass", "damped"]


def model(kind: str) -> tuple[Body, MeshData, float]:
    """Return body, mesh and critical step [s] of a bar, held if it is damped."""
    mesh = bar(held=kind == "damped")
    body, critical = dns_body(mesh, STEEL)
    return body, mesh, critical


@pytest.mark.parametrize(("fraction", "alpha"), [(0.5, 0.0), (5.0, 0.0), (5.0, -0.1), (8.0, -1 / 3)])
@pytest.mark.parametrize("kind", KINDS)
def test_energy_is_exact(kind, fraction, alpha):
    body, mesh, critical = model(kind)
    loads = loads_of(kind, body, mesh, 0.1 * critical)
    motion = ImplicitMotion(MPI.COMM_SELF, body, loads, fraction * critical, alpha)
    error, work = largest_imbalance(motion, 100)
    assert error < (1e-8 if kind == "large_mass" else 1e-10) * work


def run(motion: Motion, end: float) -> Motion:
    """Advance a motion to an end time [s], in place, and return it."""
    while motion.time < end - 0.5 * motion.step:
        motion.advance()
        motion.update_force()
    return motion


def shape_of(motion: Motion) -> np.ndarray:
    """Return the displacement relative to the base, shape (n, 3) [m]."""
    return motion.displacement - motion.base_displacement()


@pytest.mark.parametrize("kind", KINDS)
def test_motion_equals_small_explicit_steps(kind):
    body, mesh, critical = model(kind)

    def loads() -> list[Load]:
        return loads_of(kind, body, mesh, 0.0)

    end = 50 * critical
    exact = run(motion_of(body, critical / 32, loads()), end)
    implicit = run(ImplicitMotion(MPI.COMM_SELF, body, loads(), critical / 32), end)
    force = body.mass.sum() * 1e4  # reactions of a free body are round-off of this
    for values, reference, least in (
        (shape_of(implicit), shape_of(exact), 0.0),
        (implicit.present_velocity(), exact.present_velocity(), 0.0),
        (implicit.external_work, exact.external_work, 0.0),
        (implicit.damping_energy, exact.damping_energy, 0.0),
        (implicit.reaction(), exact.reaction(), 1e-3 * force),
    ):
        assert values == pytest.approx(reference, abs=0.01 * max(np.abs(reference).max(), least))


def test_initial_velocity_starts_the_energy_balance():
    body, _, critical = model("damped")
    motion = ImplicitMotion(MPI.COMM_SELF, body, [], 2 * critical)
    motion.launch(np.array([1.0, 0.0, 0.0]))
    start = motion.kinetic_energy()
    assert start == pytest.approx(0.5 * body.mass[body.free[:, 0]].sum(), rel=1e-12)
    run(motion, 40 * critical)
    assert motion.kinetic_energy() + motion.internal_energy().total == pytest.approx(start, rel=1e-11)
    assert motion.external_work == 0.0


def test_restart_is_bitwise_identical_for_all_loads():
    body, mesh, critical = model("motion")
    first, second = (
        ImplicitMotion(MPI.COMM_SELF, body, loads_of("motion", body, mesh, 0.0), 2 * critical) for _ in range(2)
    )
    run(first, 20 * critical)
    second.restore(checkpoint_state.values(first.state()))
    run(first, 40 * critical)
    run(second, 40 * critical)
    assert np.array_equal(first.displacement, second.displacement)
    assert first.external_work == second.external_work


@pytest.mark.parametrize("terms", [(0.1, 0.0), pytest.param((0.0, 0.1), marks=pytest.mark.long)])
def test_free_vibration_decays_as_its_ratio_says(terms):
    """One mode of a bar follows x = exp(-xi w t) (cos w' t + xi / s sin w' t), s^2 = 1 - xi^2, w' = s w."""
    body, _, _ = model("damped")
    equations = Equations.of(MPI.COMM_SELF, body)
    modes = natural_modes(equations, 12)
    along = int(np.argmax(modes.effective_mass[:, 0]))
    omega, shape = 2 * np.pi * modes.frequency[along], modes.shape[along]
    rayleigh = Damping(mass_ratio=terms[0], stiffness_ratio=terms[1], frequency=omega / (2 * np.pi))
    ratio, period = sum(terms), 2 * np.pi / omega
    damping = RayleighDamping.build(body, *rayleigh.coefficients)
    motion = ImplicitMotion(MPI.COMM_SELF, body, [damping], period / 400)
    motion.displacement[:] = shape
    motion.restart()
    root = np.sqrt(1 - ratio**2)
    for _ in range(3):
        run(motion, motion.time + 0.7 * period)
        phase = root * omega * motion.time
        exact = np.exp(-ratio * omega * motion.time) * (np.cos(phase) + ratio / root * np.sin(phase))
        amplitude = np.einsum("ni,n,ni->", motion.displacement, body.mass, shape)
        assert amplitude == pytest.approx(exact, abs=1e-3)
