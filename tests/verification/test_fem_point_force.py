"""Point forces against exact solutions: momentum of a free body, static deflection of a cantilever."""

import json

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import motion_of
from reflowshock.fem.dynamics.implicit import ImplicitMotion
from reflowshock.fem.loads.structure_loads import LoadedModel, structure_loads
from reflowshock.fem.loads.structure_pulses import pulses_of
from reflowshock.fem.run.structure import run_structure
from reflowshock.fem.setup.structure_models import build_structure
from tests.support.fem_structures import LENGTH, STEEL, THICKNESS, WIDTH, strip_mesh, structure_input

STEP = 5e-8
FORCE = np.array([6.0, 2.0, -9.0])  # 11 N
AT = np.array([3.1e-3, -1.7e-3, 0.8e-3])


@pytest.mark.parametrize("solver", ["explicit", "implicit"])
def test_impulse_is_the_integral_of_the_force(tmp_path, solver):
    """For a triangle in time, linear within each step, linear momentum, angular momentum and work are exact."""
    ends = STEP * np.array([0, 40, 100])
    table = tmp_path / "force.csv"
    rows = zip(ends.tolist(), (0.0, 11.0, 0.0), strict=True)
    table.write_text("time [s], force [N]\n" + "".join(f"{time!r}, {force}\n" for time, force in rows))
    poke = {"kind": "point_force", "at": AT.tolist(), "direction": FORCE.tolist(), "table": str(table)}
    numerics = {"explicit_step": STEP, "implicit_step": STEP}
    dynamics = {"duration": 130 * STEP, "numerics": numerics}
    request = structure_input(tmp_path, loads={"poke": poke}, supports={}, dynamics=dynamics, solver=solver)
    model, steps = build_structure(MPI.COMM_SELF, request, [])
    body = model.body
    loads = structure_loads(LoadedModel(MPI.COMM_SELF, body, model.tables, request), pulses_of(request.loads))
    if solver == "explicit":
        motion = motion_of(body, steps.plan.step, loads)
    else:
        motion = ImplicitMotion(MPI.COMM_SELF, body, loads, steps.plan.step)
    for _ in range(130):
        motion.advance()
        motion.update_force()
    momentum = body.mass[:, None] * motion.present_velocity()
    impulse = 0.5 * 100 * STEP * FORCE
    assert momentum.sum(axis=0) == pytest.approx(impulse, rel=1e-9)
    turning = np.cross(body.local.points, momentum).sum(axis=0)
    assert turning == pytest.approx(np.cross(AT, impulse), rel=1e-9)
    energy = motion.kinetic_energy() + motion.internal_energy().total
    assert motion.external_work == pytest.approx(energy, rel=1e-9)


@pytest.mark.parametrize("share", [1.0, 0.72])
@pytest.mark.parametrize("y", [0.0, WIDTH / 4])
def test_cantilever_at_rest_under_a_force(tmp_path, share, y):
    """The mean end deflection is F a^2 (3 L - a) / (6 E I), for any position a between nodes.

    Without lateral contraction the mean over the width of a plate follows the beam equation.
    """
    young, inertia, force, arm = STEEL["young_modulus"], WIDTH * THICKNESS**3 / 12, 5.0, share * LENGTH
    omega = 1.8751**2 * np.sqrt(young * THICKNESS**2 / (12 * STEEL["density"] * LENGTH**4))
    poke = {"kind": "point_force", "at": [arm - LENGTH / 2, y, THICKNESS], "direction": [0.0, 0.0, -1.0]}
    request = structure_input(
        tmp_path,
        strip_mesh((16, 3, 2)),
        solver="implicit",
        materials={"steel": STEEL | {"poisson_ratio": 0.0}},
        loads={"poke": poke | {"peak": force, "pulse": "constant"}},
        watch={f"tip_{k}": {"at": [LENGTH / 2, WIDTH * (k / 3 - 0.5), 0.0]} for k in range(4)},
        dynamics={
            "duration": 40 / omega,
            "damping": {"mass_ratio": 1.0 - 1e-9, "frequency": omega / (2 * np.pi)},
            "numerics": {"implicit_step": 0.05 / omega, "hht_alpha": -0.3, "history_samples": 5, "field_samples": 2},
        },
    )
    run_structure(MPI.COMM_SELF, request)
    health = json.loads((request.output / "result.json").read_text())["health"]
    assert all(check["ok"] for check in health.values())
    with np.load(request.output / "history.npz") as history:
        tip = np.array([1, 2, 2, 1]) / 6 @ [history[f"displacement@tip_{k}"][-1, 2] for k in range(4)]
        reaction = history["reaction@clamp"][-1]
    exact = -force * arm**2 * (3 * LENGTH - arm) / (6 * young * inertia)
    assert tip == pytest.approx(exact, rel=0.002)
    assert reaction == pytest.approx([0.0, 0.0, force], rel=1e-9, abs=1e-9)
