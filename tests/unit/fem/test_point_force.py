"""Point forces: nodal shares with exact resultant and moment, planes of symmetry and invalid input."""

import json

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.errors import AgreedError, LoadError
from reflowshock.fem.loads.structure_loads import LoadedModel, structure_loads
from reflowshock.fem.loads.structure_pulses import pulse_of, pulses_of
from reflowshock.fem.mesh.mesh_file import read_mesh
from reflowshock.fem.mesh.point_shares import point_shares
from reflowshock.fem.problem.inputs import INPUT
from reflowshock.fem.problem.load_kinds import PointForce
from reflowshock.fem.run.structure import run_structure
from reflowshock.fem.setup.structure_models import build_structure
from reflowshock.meshing.board.box import write_box
from reflowshock.meshing.board.box_plan import Box, BoxLayer
from tests.support.fem_structures import LENGTH, THICKNESS, WIDTH, strip_mesh, structure_input, structure_tables_of

INSIDE = (1.3e-3, -0.7e-3, 0.4e-3)
POKE = {"kind": "point_force", "at": INSIDE, "direction": [3.0, 0.0, -4.0], "peak": 10.0, "pulse": "constant"}


def bent(mesh):
    """Return a mesh of distorted cells."""
    x, y, z = mesh.points.T
    mesh.points[:] = np.column_stack([x + 0.3 * y, y + 20.0 * x * z, z + 5.0 * x * y])
    return mesh


def box_file(path, element="hexahedron", symmetry=()):
    """Write a strip of any element type and return the path."""
    cells = (8, 2 if symmetry else 4)  # on the meshed part
    write_box(Box((LENGTH, WIDTH), cells, (BoxLayer("board", THICKNESS, 2, None),), symmetry, element, None), path)
    return path


@pytest.mark.parametrize("point", [INSIDE, (0.0, 0.0, 0.5e-3), (-4.9e-3, 1.1e-3, 0.9e-3)])
def test_shares_of_bent_hexahedra_have_resultant_and_moment_of_the_force(point):
    mesh = bent(strip_mesh())
    nodes, shares = point_shares(mesh, "at", point)
    assert shares.sum() == pytest.approx(1.0, rel=1e-14)
    assert shares @ mesh.points[nodes] == pytest.approx(np.array(point), abs=1e-15)
    assert shares.min() > -1e-6


@pytest.mark.parametrize("element", ["tetrahedron", "tetrahedron_quadratic"])
def test_shares_of_tetrahedra(tmp_path, element):
    mesh = read_mesh(box_file(tmp_path / "box.msh", element))
    nodes, shares = point_shares(mesh, "at", INSIDE)
    assert len(nodes) == 4
    assert shares.sum() == pytest.approx(1.0, rel=1e-14)
    assert shares @ mesh.points[nodes] == pytest.approx(np.array(INSIDE), abs=1e-15)


@pytest.mark.parametrize("end", [-1.0, 1.0])
def test_node_carries_the_whole_force_at_its_position(end):
    mesh = strip_mesh()
    point = (0.5 * end * LENGTH, WIDTH / 6, THICKNESS)
    nodes, shares = point_shares(mesh, "at", point)
    assert mesh.points[nodes[np.argmax(shares)]] == pytest.approx(np.array(point))
    assert np.sort(shares) == pytest.approx([0.0] * 7 + [1.0], abs=1e-12)


def test_a_point_outside_is_said_with_the_nearest_node():
    words = (
        r"loads\.poke\.at = \(0\.011, 0, 0\) m lies outside the mesh: .* is \(0\.01, -?0\.00133333, 0\) m, 0\.00167 m"
    )
    with pytest.raises(LoadError, match=words):
        point_shares(strip_mesh(), "loads.poke.at", (0.011, 0.0, 0.0))


def load_of(request):
    """Return the model and the only load of a structure."""
    model, _ = build_structure(MPI.COMM_SELF, request, [])
    (load,) = structure_loads(LoadedModel(MPI.COMM_SELF, model.body, model.tables, request), pulses_of(request.loads))
    return model, load


def test_load_has_resultant_and_moment_of_the_force(tmp_path):
    model, load = load_of(structure_input(tmp_path, loads={"poke": POKE}))
    force = load.pulse.value(1e-6) * load.pattern
    assert force.sum(axis=0) == pytest.approx([6.0, 0.0, -8.0], rel=1e-12, abs=1e-12)
    moment = np.cross(model.body.local.points[load.nodes], force).sum(axis=0)
    assert moment == pytest.approx(np.cross(INSIDE, [6.0, 0.0, -8.0]), rel=1e-12)


@pytest.mark.parametrize("parameters", [{"peak": 2.0, "duration": 1e-4}, {"table": "force.csv"}])
def test_course_is_a_half_sine_or_a_table(tmp_path, monkeypatch, parameters):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "force.csv").write_text("time [ms], force [kN]\n0,0\n0.05,2e-3\n0.1,0\n")
    load = PointForce.model_validate({"at": INSIDE, "direction": [0.0, 0.0, 1.0]} | parameters)
    pulse = pulse_of(load)
    assert pulse.value(5e-5) == pytest.approx(2.0)
    assert pulse.integral(1.0) == pytest.approx(2e-4 * (0.5 if "table" in parameters else 2 / np.pi))


def tip_of(directory, symmetry, loads):
    """Run a full or half strip; return the motion of an end point and the external work."""
    directory.mkdir()
    mesh = box_file(directory / "box.msh", symmetry=symmetry)
    tables = structure_tables_of(loads=loads, watch={"tip": {"at": [LENGTH / 2, WIDTH / 4, THICKNESS]}})
    tables["structure"] = tables["structure"] | {"symmetry": symmetry}
    request = INPUT.validate_json(json.dumps(tables | {"mesh": str(mesh), "output": str(directory)}))
    run_structure(MPI.COMM_SELF, request)
    with np.load(directory / "history.npz") as history:
        return history["displacement@tip"], history["external"]


@pytest.mark.parametrize("places", [[0.0], [-2.6e-3, 2.6e-3]], ids=["on the plane", "beside it"])
def test_half_a_body_moves_as_the_whole(tmp_path, places):
    """A force on the plane of symmetry is halved; any other force has a mirror image."""
    pushes = {f"push_{k}": POKE | {"at": [5e-3, y, THICKNESS]} for k, y in enumerate(places)}
    whole, all_work = tip_of(tmp_path / "whole", (), pushes)
    half, work = tip_of(tmp_path / "half", ("y",), dict([pushes.popitem()]))
    assert np.abs(whole[:, 2]).max() > 0.0
    assert half == pytest.approx(whole, abs=1e-9 * np.abs(whole).max())
    assert 2.0 * work == pytest.approx(all_work, rel=1e-9)


def test_a_point_in_the_box_that_the_mesh_lacks(tmp_path):
    body = structure_tables_of()["structure"] | {"length": 1.2 * LENGTH}
    poke = POKE | {"at": [0.55 * LENGTH, 0.0, 0.0]}
    with pytest.raises(AgreedError, match=r"loads\.poke\.at = \(0\.011, 0, 0\) m lies outside the mesh"):
        run_structure(MPI.COMM_SELF, structure_input(tmp_path, structure=body, loads={"poke": poke}))
