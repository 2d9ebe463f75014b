"""Hard divisions into macro and meso model: stable, exact at tie and interface, or rejected."""

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.coupled import Coupled, models_of, surveyed
from reflowshock.cases.hard.trials.layouts import board, copper_interface, corner, joint, overhang, two_regions
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.coupling.self_check import self_check
from reflowshock.fem.division.checks import check_division
from reflowshock.fem.division.divide import cut_nodes, divide, held_velocity_division
from reflowshock.fem.division.whole import touching
from reflowshock.fem.errors import CouplingError
from reflowshock.fem.mesh.mesh import MeshData, append
from reflowshock.fem.parallel.exchange import InterfaceChannels
from reflowshock.fem.problem.shock import Coupling
from reflowshock.materials.roles import ELASTIC


def radius(mesh: MeshData, scheme: str) -> float:
    """Return the spectral radius of a window of both models into which a scheme divides a mesh."""
    models = models_of(mesh, ELASTIC, Coupling(scheme=scheme), 0.9)
    assert models.division.plan.substeps > 3
    return Coupled(models.bodies(), models.division.plan, scheme_of(scheme)).spectral_radius()


def test_cut_through_copper_and_board_is_stable_in_local_steps():
    mesh = copper_interface()
    scene = surveyed(mesh, coupling=Coupling(scheme="local_steps", levels=1))
    division = divide(*scene)
    at_interface = touching(mesh.cells, cut_nodes(mesh.cells, division.meso, len(mesh.points)))
    assert {"board", "copper"} <= set(scene[1].role[at_interface & division.macro])
    assert "copper" in scene[1].role[at_interface & division.meso]
    assert radius(mesh, "local_steps") <= 1 + 1e-8
    with pytest.raises(CouplingError, match=r"must belong to the board, found \d+ of copper.*scheme = local_steps"):
        check_division(*scene[:2], held_velocity_division(*scene, division.meso), scene[2])


@pytest.mark.parametrize("scheme", ["held_velocity", "local_steps"])
def test_thin_overhang_is_stable(scheme):
    assert radius(overhang(), scheme) <= 1 + 1e-8


def test_meso_model_in_a_corner_touches_two_faces_and_an_edge():
    scene = surveyed(corner())
    division = divide(*scene)
    check_division(*scene[:2], division, scene[2])
    mesh = scene[0].mesh
    interface = mesh.points[cut_nodes(mesh.cells, division.meso, len(mesh.points))]
    on_faces = np.abs(interface[:, :2]) < 1e-12
    assert on_faces.any(axis=0).all()
    assert on_faces.all(axis=1).any()
    buffer = division.meso & scene[2].coarse
    assert buffer.sum() == 3 * 3 * 2  # one master facet and two layers around its nodes


def test_meso_models_may_be_several_regions():
    scene = surveyed(two_regions())
    division = divide(*scene)
    check_division(*scene[:2], division, scene[2])
    assert (division.meso & scene[2].coarse).sum() == 2 * 3 * 3 * 2


@pytest.mark.parametrize("off", [[-1e-9, 0.0, 0.0], [-1e-9, -1e-9, -1e-9], [0.0, 0.0, 1e-9]])
def test_points_a_little_outside_the_interface_are_tied_exactly(off):
    foot = joint(0.2e-3, 0.2e-3)
    foot.points[:] += off
    scene = surveyed(append([board(), foot]))
    assert 0.0 < scene[0].moved < 2e-9
    models = models_of(append([board(), foot]), ELASTIC, Coupling(scheme="held_velocity"), 0.9)
    bodies = models.bodies()
    channels = InterfaceChannels.open(
        MPI.COMM_SELF, bodies["macro"].interface, bodies["meso"].interface, receiver_waits=False
    )
    checked = self_check(MPI.COMM_SELF, bodies, channels)
    checked.judge()
    assert max(checked.rigid, checked.linear, checked.tie, checked.interface) < 1e-12
    assert checked.interface_mass > 0.0


def test_self_check_detects_a_wrong_weight():
    models = models_of(append([board(), joint(0.5e-3, 0.5e-3)]), ELASTIC, Coupling(scheme="held_velocity"), 0.9)
    bodies = models.bodies()
    channels = InterfaceChannels.open(
        MPI.COMM_SELF, bodies["macro"].interface, bodies["meso"].interface, receiver_waits=False
    )
    bodies["meso"].tie.weight[0] += [1e-9, -1e-9, 0.0, 0.0]
    checked = self_check(MPI.COMM_SELF, bodies, channels)
    assert min(checked.linear, checked.tie) > 1e-12
    with pytest.raises(RuntimeError, match="residuals must be at most 1e-12"):
        checked.judge()
