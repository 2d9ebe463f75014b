"""Bitwise restart of interrupted runs: moving joints, drops and each solver option."""

from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from scipy import sparse

from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.cloud import box_cloud, sphere_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.plate import joint_plates
from reflowshock.particles.parameters.scenes import Drop, Drops
from reflowshock.particles.parameters.solder import Solder, SolderEffects, SolderNumerics
from reflowshock.particles.physics.plate_motion import LIFT, Floating, Travel
from reflowshock.particles.scenes.carried_joint import carried_shape, carry_joint
from reflowshock.particles.scenes.drop_at_rest import flow_to_rest
from reflowshock.particles.scenes.drop_pair import pair_to_rest
from reflowshock.particles.scenes.drops import run_drops
from reflowshock.particles.scenes.flow_setup import contact_line, start_flow, stop_rule
from reflowshock.particles.scenes.free_drop import solve_free_drop
from reflowshock.particles.scenes.moving_joint import follow_path, settle_joint
from reflowshock.particles.scenes.reflow import LiquidJoint
from reflowshock.particles.steps.rest import RECORDS, NotAtRest

RADIUS = 0.24e-3
JOINT = JointGeometry(0.31e-3, RADIUS, RADIUS)
SOLDER = Solder(volume=0.0724e-9, numerics=SolderNumerics(spacing=1e-4, time_step_limit=100))
WETTING = dict.fromkeys(("surface_tension", "gravity", "wall_adhesion", "viscosity", "inertia"), True)
FREE = {"surface_tension": True, "gravity": False, "wall_adhesion": False, "viscosity": False, "inertia": False}


class BrokenOff(Exception):
    pass


class BreakingCheckpoint(Checkpoint):
    """Checkpoint after every step that interrupts the run after a given number."""

    def __init__(self, path, steps):
        super().__init__(path, ("inputs",), 0.0)
        self.left = steps

    def write(self, state):
        super().write(state)
        self.left -= 1
        if self.left == 0:
            raise BrokenOff


def points_of(shapes):
    """Return the particle positions of shapes."""
    return [shape.points for shape in shapes]


def settle(checkpoint):
    """Return the positions of a joint under a floating package, run with a checkpoint."""
    plate = Floating(1, LIFT, np.array([0.0, 0.0, 1e-4]))
    return points_of([settle_joint(JOINT, SOLDER, (plate,), checkpoint=checkpoint)])


def follow(checkpoint):
    """Run a joint to three positions, interrupted on the way to the second."""
    path = [JointGeometry(gap, RADIUS, RADIUS) for gap in (0.29e-3, 0.27e-3)]

    def at(number):
        path = checkpoint.path.with_name(f"{number}")
        return BreakingCheckpoint(path, checkpoint.left if number == 1 else -1)

    return points_of(follow_path(JOINT, SOLDER, path, at if checkpoint else None))


def pull(checkpoint):
    """Run a package pulled up and sideways in the scheme ispg for some steps."""
    end = joint_plates(JointGeometry(0.34e-3, RADIUS, RADIUS, (1e-5, 0.0), (0.0, 0.01)))[1]
    return moved_in_galerkin_form(Travel(1, end, 0.2, RADIUS), checkpoint)


def float_on(checkpoint):
    """Run a floating package in the scheme ispg for some steps."""
    return moved_in_galerkin_form(Floating(1, LIFT, np.array([0.0, 0.0, 1e-4])), checkpoint)


def viscous():
    """Return solder with strong viscous damping in a short process."""
    effects = SolderEffects(inertia="on", viscosity="on")
    numerics = SolderNumerics(spacing=8e-5, scheme="ispg", time_step_limit=100)
    fluid = {"surface_tension": 4.985, "viscosity": 0.227, "process_time": 2e-4}
    return SOLDER.model_copy(update={"effects": effects, "numerics": numerics, **fluid})


def coarse_viscous(process_time):
    """Return viscous solder with fewer particles, which rests after some hundred steps."""
    solder = viscous()
    numerics = solder.numerics.model_copy(update={"spacing": 1e-4})
    return solder.model_copy(update={"numerics": numerics, "process_time": process_time})


def moved_in_galerkin_form(motion, checkpoint):
    """Return arrays of a joint moved by the scheme ispg with a checkpoint."""
    shape = settle_joint(JOINT, viscous(), (motion,), checkpoint=checkpoint)
    assert len(shape.history["time"]) > 8
    return [shape.points, shape.velocity, shape.history["energy"], np.array(shape.metrics["offset"][0])]


def carry(checkpoint, solder=SOLDER):
    """Carry a joint from a file to another position with an interruption, and return its shape."""
    if checkpoint is None:
        with TemporaryDirectory() as folder:
            return carry(BreakingCheckpoint(Path(folder) / "state", -1), solder)
    first, now = (Checkpoint(checkpoint.path.with_name(name), ("inputs",)) for name in ("first", "now"))
    moved = JointGeometry(0.29e-3, RADIUS + 1e-10, RADIUS, (1e-5, 0.0), (0.0, -0.01))  # equal, but not bitwise
    carry_joint(JOINT, solder, None, first)
    wrenches = carry_joint(moved, solder, first, BreakingCheckpoint(now.path, checkpoint.left)).wrenches
    return [wrenches, carried_shape(moved, solder, first, now).points]


def carry_in_galerkin_form(checkpoint):
    """Return arrays of a carried joint by the scheme ispg with a checkpoint."""
    return carry(checkpoint, coarse_viscous(1.0))


def stand(checkpoint):
    """Run a drop with contact angle hysteresis."""
    drop = Drop(volume=1e-9, receding_angle=1.0, advancing_angle=2.2, particles_per_edge=5)
    flow, _ = flow_to_rest(drop, SOLDER.model_copy(update={"volume": 1e-9}), checkpoint=checkpoint)
    return [flow.body.points, *(line.state for line in flow.physics.lines)]


def stand_with_inertia(checkpoint):
    """Run a drop with contact-line friction, interrupted while some vertices are pinned."""
    solder = flow_of("ispg", 20.0)[1].model_copy(update={"process_time": 8e-4})
    drop = Drop(volume=1e-9, receding_angle=1.0, advancing_angle=2.2, particles_per_edge=7)
    flow, run = flow_to_rest(drop, solder, checkpoint=checkpoint)
    assert len(run.records) > 8
    assert flow.solver.state.losses.line > 0.0
    return [
        flow.body.points,
        flow.body.velocity,
        run.history(1.0)["energy"],
        *(line.state for line in flow.physics.lines),
    ]


def flow_of(scheme, limit, section="none"):
    """Return the flow of a drop with inertia for some steps."""
    effects = SolderEffects(inertia="on", viscosity="on")
    numerics = SolderNumerics(spacing=1e-4, scheme=scheme, time_step_limit=limit)
    solder = Solder(volume=1e-9, effects=effects, numerics=numerics, process_time=2e-4)
    return Drop(volume=1e-9, contact_angle=1.7, particles_per_edge=7, section=section), solder


def flow_with(scheme, limit, checkpoint, section="none"):
    """Return arrays of a drop at rest by a scheme, run with a checkpoint."""
    flow, run = flow_to_rest(*flow_of(scheme, limit, section), checkpoint=checkpoint)
    assert len(run.records) > 8
    return [flow.body.points, flow.body.velocity, flow.body.pressure, run.history(1.0)["energy"]]


def flow_as_printed(checkpoint):
    """Return arrays of a drop at rest by the published scheme, run with a checkpoint."""
    return flow_with("gripc", 0.5, checkpoint)


def flow_in_galerkin_form(checkpoint):
    """Return arrays of a drop at rest by the scheme ispg, run with a checkpoint."""
    return flow_with("ispg", 0.5, checkpoint)


def flow_in_section(checkpoint):
    """Return arrays of a drop in section at rest, run with a checkpoint."""
    return flow_with("ispg", 0.5, checkpoint, "axisymmetric")


def swing(checkpoint):
    """Return arrays of an oscillating drop, run with a checkpoint."""
    drop = solve_free_drop(SOLDER, amplitude=0.1, periods=0.1, steps_per_period=100, checkpoint=checkpoint)
    return [drop.points, *drop.history.values(), *(snapshot.points for snapshot in drop.snapshots)]


def merge(checkpoint):
    """Return arrays of two merging drops, run with a checkpoint."""
    flows = [start_flow(sphere_cloud(1e-10, 3), SOLDER, FREE, ()) for _ in range(2)]
    spacing = flows[0].body.cloud.spacing
    flows[1].body.points[:, 0] += 2.0 * np.cbrt(3e-10 / (4.0 * np.pi)) + 0.5 * spacing
    start = partial(start_flow, solder=SOLDER, effects=FREE, lines=())
    rule = stop_rule(flows[0].body.cloud, SOLDER, FREE)
    drops = run_drops(flows, rule, lambda body: start(body.cloud), checkpoint)
    return [drop.flow.body.points for drop in drops]


def merge_with_inertia(checkpoint):
    """Run two initially merged balls with splits and collapses of surface edges."""
    scene = Drops(volume_left=1e-10, volume_right=2e-10, distance=6.6e-4, spacing=1e-4)
    solder = flow_of("ispg", 20.0)[1].model_copy(update={"volume": scene.volume, "process_time": 8e-4})
    shape = pair_to_rest(scene, solder, checkpoint=checkpoint).shape
    assert shape.verdict == "merged" and len(shape.history["time"]) > 8
    assert shape.metrics["rebuilding_loss"][0] > 0.01
    return [shape.points, shape.velocity, shape.pressure, shape.history["energy"]]


FLOWS = [flow_as_printed, flow_in_galerkin_form, flow_in_section]
RUNS = [
    settle,
    follow,
    pull,
    float_on,
    carry,
    pytest.param(carry_in_galerkin_form, marks=pytest.mark.long),
    stand,
    stand_with_inertia,
    *FLOWS,
    pytest.param(swing, marks=pytest.mark.long),
    pytest.param(merge, marks=pytest.mark.long),
    merge_with_inertia,
]


@pytest.mark.parametrize("run", RUNS)
def test_interrupted_run_continues_bitwise(tmp_path, run):
    path = tmp_path / "state"
    with pytest.raises(BrokenOff):
        run(BreakingCheckpoint(path, 5))
    expected, actual = run(None), run(BreakingCheckpoint(path, -1))
    assert len(actual) == len(expected)
    assert all(np.array_equal(left, right) for left, right in zip(actual, expected, strict=True))


def leaves(value, path=""):
    """Yield all numbers and arrays of an object with their paths, except PETSc objects, which are rebuilt."""
    if sparse.issparse(value):
        value = {name: getattr(value, name) for name in ("data", "indices", "indptr", "shape")}
    if path.endswith("/_solver"):
        return
    if value is None or isinstance(value, bool | int | float | str | np.ndarray | np.generic):
        yield path, value
        return
    if isinstance(value, list | tuple):
        value = dict(enumerate(value))
    if not isinstance(value, dict):
        slots = [name for kind in type(value).__mro__ for name in getattr(kind, "__slots__", ())]
        value = getattr(value, "__dict__", {}) | {name: getattr(value, name) for name in slots}
    for name, part in value.items():
        yield from leaves(part, f"{path}/{name}")


def start_drop(scheme, limit):
    """Return the flow of a cube on a wall by a scheme, at time 0."""
    drop, solder = flow_of(scheme, limit)
    cloud = box_cloud(drop.edge, drop.count)
    return start_flow(cloud, solder, WETTING, (contact_line(cloud, 0, np.inf, solder),))


@pytest.mark.parametrize(
    "begin",
    [
        lambda: LiquidJoint(JOINT, SOLDER).start(),
        lambda: start_drop("energy", 20),
        lambda: start_drop("ispg", 2.0),
        lambda: start_drop("gripc", 0.5),
    ],
    ids=["relaxation", "inertial", "ispg", "gripc"],
)
def test_checkpoint_contains_the_whole_state(tmp_path, begin):
    """All state of the flow, its solver and its physics must be saved."""
    flow, again = begin(), begin()
    for _ in range(4):
        flow.step()
    Checkpoint(tmp_path / "state", ()).write(flow.saved())
    again.restore(Checkpoint(tmp_path / "state", ()).read(RECORDS))
    actual, expected = dict(leaves(again)), dict(leaves(flow))
    assert actual.keys() == expected.keys()
    different = [path for path, value in expected.items() if not np.array_equal(actual[path], value)]
    assert not different


def test_an_exchange_that_ends_with_the_process_passes_no_forces_on(tmp_path):
    now = Checkpoint(tmp_path / "state", ("inputs",))
    for _ in range(2):  # from the start and from the checkpoint
        with pytest.raises(NotAtRest, match=r"process ends before the joint is at rest.*solder\.process_time"):
            carry_joint(JOINT, coarse_viscous(2e-4), None, now)


def test_a_carried_joint_has_no_time_to_rest_and_no_losses(tmp_path):
    now, solder = Checkpoint(tmp_path / "state", ("inputs",)), coarse_viscous(1.0)
    carry_joint(JOINT, solder, None, now)
    metrics = carried_shape(JOINT, solder, now, now).metrics
    assert {"energy_imbalance", "particles_lost", "steps"} < set(metrics)
    assert not any(name == "time_at_rest" or name.endswith("_loss") for name in metrics)
