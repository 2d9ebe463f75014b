"""Detection of planted faults in reflow and remeshing by the limits of the hard cases."""

from dataclasses import replace

import pytest

from reflowshock.cases.hard.collector import HARD
from reflowshock.cases.hard.hard_case import read_hard_cases
from reflowshock.cases.hard.verdict import attempt
from reflowshock.meshing.joint import swept as levels
from reflowshock.meshing.joint.joint_mesh import JointPlace
from reflowshock.meshing.surface import user_surface
from reflowshock.particles.physics.forces import Gravity, Wetting
from reflowshock.particles.steps.inertial_step import InertialFlow


def flip(patch, owner, name):
    """Make a method return its result with the opposite sign."""
    whole = getattr(owner, name)
    patch.setattr(owner, name, lambda *arguments: -whole(*arguments))


def double_step(patch):
    """Plant a fault: flows with inertia take twice their time step."""
    whole = InertialFlow.step
    patch.setattr(InertialFlow, "step", lambda self, time_step: whole(self, 2.0 * time_step))


def flip_shear(patch):
    """Move the head of a joint away from a warped package instead of towards it."""
    whole = JointPlace.rise
    patch.setattr(JointPlace, "rise", lambda self, points: -whole(self, points))


def forget_volume(patch):
    """Plant a fault: swept meshes are not scaled to their volume."""
    patch.setattr(levels, "volume_keeping_scale", lambda swept_volume, volume: 1.0)


def forget_check(patch):
    """Plant a fault: surfaces from files are not checked."""
    patch.setattr(user_surface, "check_triangulation", lambda *arguments: None)


FAULTS = [
    pytest.param(
        "reflow_resolution",
        "particles per edge 5",
        lambda patch: flip(patch, Wetting, "force"),
        marks=pytest.mark.long,
    ),
    ("reflow_bond", "bond 1, contact angle 60 deg", lambda patch: flip(patch, Gravity, "force")),
    pytest.param("reflow_swing", "amplitude 0.05, parameters paper", double_step, marks=pytest.mark.long),
    ("remesh_warped", "corner 0.1 mm", flip_shear),
    ("remesh_barrel", "bulge 0.1 mm", forget_volume),
    ("remesh_refused_inside_out", "", forget_check),
]
IDS = ["wall adhesion", "gravity", "step", "head", "volume", "normals"]


@pytest.mark.parametrize(("name", "tried", "fault"), FAULTS, ids=IDS)
def test_planted_fault_is_detected(name, tried, fault, monkeypatch):
    (case,) = (case for case in read_hard_cases(HARD / f"{name}.toml") if case.tried == tried)
    assert attempt(case).ok
    fault(monkeypatch)
    verdict = attempt(case)
    assert not verdict.ok, verdict.checks


def test_failed_run_reports_its_own_message():
    (case,) = read_hard_cases(HARD / "reflow_run.toml")
    parameters = case.parameters.model_copy(update={"settings": {"drop": {"particles_per_edge": 1}}})
    verdict = attempt(replace(case, parameters=parameters))
    assert "drop.particles_per_edge = 1: is out of range" in verdict.message, verdict
