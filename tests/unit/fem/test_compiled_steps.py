"""All steps of a window in one compiled call equal single steps, except for the order of sums."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import SOLDER
from reflowshock.fem.division.tables import prepare
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.dynamics.compiled_steps import CompiledSteps
from reflowshock.fem.errors import InvertedElementError
from reflowshock.fem.kernels.levels import Interface
from reflowshock.fem.loads.damping import RayleighDamping, WindowDrag
from reflowshock.fem.loads.load import half_sine_drop
from reflowshock.fem.model.assembly import ForceOptions, make_body, make_rank_elements
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.materials.roles import Materials
from tests.support.fem_levels import joint_on_board

STEP, STEPS = 1e-9, 6
SETTINGS = {
    "small": ("one_point", ForceOptions("small", STEP), {"congruent", "assembled", "one_point", "path"}),
    "turning": ("one_point", ForceOptions("corotational", STEP), {"turning_boxes", "turning", "one_point", "path"}),
    "modes": ("incompatible_modes", ForceOptions("corotational", STEP), {"hexahedron", "path"}),
}


def body_of(formulation: str, response: ForceOptions, pace: int = 1):
    """Return a plastic joint tied to a board, with some distorted elements and a pace for the lowest ones."""
    mesh = joint_on_board(edges=6)
    copper = np.unique(mesh.cells[mesh.in_parts(lambda name: name.startswith("copper"))])
    low = copper[mesh.points[copper, 2] < np.median(mesh.points[copper, 2])]
    mesh.points[low, :2] *= 1.0 + 0.02 * np.cos(1e4 * mesh.points[low, 1:2])
    item = prepare(mesh, "dns")["dns"]
    below = item.mesh.points[item.mesh.cells, 2].mean(axis=1) < -0.2e-3
    tables = replace(item.tables, every=np.where(below, pace, 1).astype(np.int32))
    rank_elements = make_rank_elements(
        distribute(MPI.COMM_SELF, item.mesh), tables, Materials(solder=SOLDER), formulation
    )
    return make_body(MPI.COMM_SELF, rank_elements, tables, np.ones(len(rank_elements.steps)), response)


def moving(body, loads=(), speed: float = 20.0) -> tuple[ExplicitMotion, Interface]:
    """Return a motion with random velocities, and nodes that another model moves in its steps."""
    rows = np.arange(12, dtype=np.int32)
    motion = ExplicitMotion(body, loads, STEP, rows, np.zeros(len(body.mass)))
    random = np.random.default_rng(3)
    motion.velocity[:] = random.uniform(-speed, speed, motion.velocity.shape)
    velocity, change = motion.velocity[rows], random.uniform(-1.0, 1.0, (STEPS, 3))
    return motion, Interface(
        rows, rows[::2].copy(), velocity, change, random.random((STEPS + 1, 2)), np.zeros((2, 6, 3))
    )


@pytest.mark.parametrize("pace", [1, 3])
@pytest.mark.parametrize("name", SETTINGS)
def test_compiled_steps_are_those_one_by_one(name, pace):
    formulation, response, entries = SETTINGS[name]
    drop = half_sine_drop(1e7, 20 * STEP)
    ended = []
    for take in (ExplicitMotion.take_steps, ExplicitMotion._take_single_steps):
        body = body_of(formulation, response, pace)
        assert entries <= set().union(*CompiledSteps.of(body, [drop]).terms)
        assert len(body.schedule) == (1 if pace == 1 else 2)
        motion, interface = moving(body, [drop])
        take(motion, STEPS, interface)
        history = [array for term in body.terms for array in term.history.values()]
        ended.append(
            (
                motion,
                [
                    *([motion.ahead] if pace > 1 else []),
                    motion._state,
                    motion.slave_force,
                    motion.gravity,
                    interface.impulses,
                    *history,
                ],
            )
        )
    (motion, first), (other, second) = ended
    for left, right in zip(first, second, strict=True):
        assert np.abs(left - right).max() <= 1e-13 * np.abs(right).max()
    assert motion.time == other.time
    assert motion.external_work == pytest.approx(other.external_work, rel=1e-12)
    assert motion.internal_energy().plastic > 0.0


def test_nodes_that_move_most_often_come_first():
    body = body_of(*SETTINGS["turning"][:2], pace=3)
    _, node = body.node_paces
    assert np.all(np.diff(node) >= 0)
    ends = CompiledSteps.of(body, []).ends
    assert ends.tolist() == [np.sum(node == 1), len(node), len(node)]


def test_inverted_elements_raise_the_same_error():
    errors = []
    for take in (ExplicitMotion.take_steps, ExplicitMotion._take_single_steps):
        motion, interface = moving(body_of(*SETTINGS["turning"][:2]), speed=2e4)
        with pytest.raises(InvertedElementError) as error:
            take(motion, STEPS, interface)
        errors.append((str(error.value), motion.time))
    assert errors[0] == errors[1]


def test_what_acts_between_steps_is_no_matter_of_one_call():
    body = body_of(*SETTINGS["small"][:2])
    damping = RayleighDamping.build(body, 1.0, 0.0)
    assert CompiledSteps.of(body, [damping]) is None
    assert CompiledSteps.of(body, WindowDrag.once_a_window([damping], STEPS)) is not None
    assert CompiledSteps.of(replace(body, terms=[*body.terms, SimpleNamespace(history={})]), []) is None
    assert CompiledSteps.of(replace(body, terms=[*body.terms, body.terms[0]]), []) is None
