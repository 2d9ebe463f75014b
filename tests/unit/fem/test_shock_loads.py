"""Pulse, gravity and loads of a package shock: invalid combinations and loads without effect."""

import numpy as np
import pytest
from mpi4py import MPI
from pydantic import ValidationError

from reflowshock.cases.hard.trials.bodies import dns_body, motion_of
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.division.tables import prepare
from reflowshock.fem.dynamics.compiled_steps import acts_at_nodes
from reflowshock.fem.dynamics.energy_balance import SUMS, EnergyBalance
from reflowshock.fem.errors import EnergyError, LoadError
from reflowshock.fem.loads.large_mass import LargeMass, ShakenBase
from reflowshock.fem.loads.load import BodyAcceleration, PrescribedVelocity
from reflowshock.fem.loads.pulse import Constant, HalfSine
from reflowshock.fem.loads.shock_loads import shock_loads
from reflowshock.fem.loads.shock_pulse import shock_pulse
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.model.body import Body
from reflowshock.fem.problem import shock_checks
from reflowshock.fem.problem.shock import BoardDamping, Shock
from tests.support.fem_bodies import STEEL

G = 9.80665


def shock(**changes) -> Shock:
    """Return the parameters of a shock of 1500 G for 0.5 ms; ``changes`` replace fields."""
    return Shock(**({"peak_acceleration": 1500 * G, "pulse_duration": 5e-4, "duration": 1e-3} | changes))


def test_half_sine_and_service_condition_b_are_the_same():
    by_name = shock_pulse(shock(peak_acceleration=None, pulse_duration=None, service_condition="B"))
    explicit = shock_pulse(shock())
    assert by_name.source == "JEDEC service condition B"
    for time in (0.0, 1e-4, 2.5e-4, 6e-4):
        assert by_name.pulse.value(time) == pytest.approx(explicit.pulse.value(time), rel=1e-12)


def test_tabulated_shock(tmp_path):
    path = tmp_path / "drop.csv"
    path.write_text("time [ms], acceleration [G]\n0, 0\n0.25, 1500\n0.5, 0\n")
    pulse = shock_pulse(shock(peak_acceleration=None, pulse_duration=None, table=str(path)))
    assert pulse.source == "table drop.csv"
    assert pulse.pulse.value(1.25e-4) == pytest.approx(750 * G)


@pytest.mark.parametrize(
    ("changes", "on"),
    [({}, False), ({"peak_acceleration": 100 * G}, True), ({"gravity": "on"}, True), ({"gravity": "off"}, False)],
)
def test_gravity_is_left_out_where_it_is_negligible(changes, on):
    pulse = shock_pulse(shock(**changes))
    assert pulse.gravity["on"] is on
    assert pulse.gravity["why"]
    assert pulse.gravity["influence"] == pytest.approx(G / changes.get("peak_acceleration", 1500 * G))


PROBLEMS = {
    "shock.peak_acceleration": {"peak_acceleration": None, "pulse_duration": None},
    "shock.pulse_duration": {"pulse_duration": None},
    "shock.table": {"peak_acceleration": None, "pulse_duration": None, "service_condition": "B", "table": "a.csv"},
    "shock.damping.estimate": {"damping": BoardDamping(estimate="on", mass_coefficient=10.0)},
    "shock.damping.frequency": {"damping": BoardDamping(mass_ratio=0.01)},
    "shock.numerics.kinematics": {
        "damping": BoardDamping(stiffness_coefficient=1e-9),
        "numerics": {"kinematics": "finite"},
    },
}


@pytest.mark.parametrize("key", PROBLEMS)
def test_what_does_not_fit_together_is_named(key):
    assert [problem.key for problem in shock_checks.problems(shock(**PROBLEMS[key]))] == [key]


def test_possible_shock_has_no_problem():
    assert not shock_checks.problems(shock(damping=BoardDamping(stiffness_ratio=0.01, frequency=1e3)))
    with pytest.raises(ValidationError, match="service_condition"):
        shock(service_condition="J")


def box(held: bool) -> tuple[MeshData, Body]:
    """Return mesh and body of two elements, held by symmetry or free."""
    points, cells = grid([0.0, 1e-3, 2e-3], [0, 1e-3], [0, 1e-3])
    facets = {"low": on(0, 0.0), "high": on(0, 2e-3)} | ({"symmetry_x": on(0, 0.0)} if held else {})
    mesh = mesh_of(points, cells, "board", facets)
    return mesh, dns_body(mesh, STEEL)[0]


def test_large_mass_needs_nodes_that_are_free():
    mesh, body = box(held=True)
    up = np.array([0.0, 0.0, 1.0])
    with pytest.raises(LoadError, match="support nodes that are free to move: the model has none"):
        LargeMass.build(MPI.COMM_SELF, body, np.empty(0, int), BodyAcceleration(up, Constant(1.0)))
    with pytest.raises(LoadError, match="4 of their components are held"):
        LargeMass.build(MPI.COMM_SELF, body, mesh.facet_nodes("low"), BodyAcceleration(up, Constant(1.0)))


def test_motion_of_a_held_component_is_refused():
    mesh, body = box(held=True)
    with pytest.raises(LoadError, match="prescribed motion along x acts on nodes that are held"):
        motion_of(body, 1e-8, [PrescribedVelocity(body.local.locate(mesh.facet_nodes("low")), 0, Constant(1.0))])


def test_weight_of_the_large_mass_does_not_move_the_base():
    mesh, body = box(held=False)
    low = mesh.facet_nodes("low")
    along = np.array([1.0, 0.0, 0.0])
    motion = motion_of(
        body,
        1e-8,
        [
            LargeMass.build(MPI.COMM_SELF, body, low, BodyAcceleration(along, Constant(1e3))),
            BodyAcceleration(along, Constant(G)),
        ],
    )
    for _ in range(50):
        motion.advance()
        motion.update_force()
    base = motion.displacement[body.local.locate(low), 0]
    assert base == pytest.approx(-0.5 * 1e3 * motion.time**2, rel=1e-4)
    assert motion.base_displacement()[0] == pytest.approx(-0.5 * 1e3 * motion.time**2, rel=1e-10)


def test_model_without_holes_has_no_load_at_nodes():
    mesh, body = box(held=True)
    tables = prepare(mesh, "dns")["dns"].tables
    (load,) = shock_loads(MPI.COMM_SELF, 1.0, body, tables, shock(method="large_mass"))
    assert isinstance(load, ShakenBase)
    assert not acts_at_nodes(load)


def test_base_that_follows_time_moves_as_the_large_mass_does():
    mesh, body = box(held=False)
    along, pulse = np.array([1.0, 0.0, 0.0]), HalfSine(1500 * G, 4e-6)
    base = BodyAcceleration(along, pulse)
    motion = motion_of(body, 1e-8, [LargeMass.build(MPI.COMM_SELF, body, mesh.facet_nodes("low"), base)])
    base = ShakenBase(along, pulse)
    for _ in range(600):  # beyond the pulse
        motion.advance()
        motion.update_force()
    near = (np.pi * motion.step / pulse.duration) ** 2  # twelve times the error of the trapezoidal rule
    assert base.base_velocity(motion.time) == pytest.approx(motion.base_velocity(), rel=near)
    assert base.base_displacement(motion.time) == pytest.approx(motion.base_displacement(), rel=near)


def test_ledger_says_what_grew_and_which_step_it_was():
    balance = EnergyBalance(limit=0.02, trivial=0.0, step=1e-9, critical=9e-10)
    sums = np.zeros(SUMS)
    balance.judge(sums, 0.0)
    sums[1] = np.inf
    expected = (
        r"energies are not finite at time 1\.0+e-06 s \(step 1000\): the internal energy went from 0\.000e\+00 J to"
        r" inf J since the previous sample; step 1\.000e-09 s, estimated critical step 9\.000e-10 s; the time step"
    )
    with pytest.raises(EnergyError, match=expected):
        balance.judge(sums, 1e-6)
