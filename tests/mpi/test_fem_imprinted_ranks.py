"""Joints in columns, one swept and one free-form: equal on any ranks, sections in balance, two scales."""

import json
from pathlib import Path

import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import MM, board, package
from reflowshock.cases.hard.trials.surfaces import barrel, with_void
from reflowshock.meshing.board.assembly import write_assembly
from reflowshock.meshing.board.displaced_assembly import prescribed_displacement, write_displaced_assembly
from reflowshock.meshing.board.pads import pad_table
from reflowshock.meshing.board.parameters import Warpage
from reflowshock.meshing.joint.column import columns_of
from reflowshock.meshing.joint.joints_file import write_joints
from reflowshock.meshing.joint.solder_mesh import mesh_joint
from reflowshock.workflow.process.products import read_json
from tests.support.fem_program import run_programs

WARPAGE = Warpage(corner=0.02 * MM)
SHOCK = {
    "peak_acceleration": 14709.975,
    "pulse_duration": 5e-4,
    "duration": 1.2e-5,
    "numerics": {"kinematics": "small", "history_samples": 20, "field_samples": 2},
}
RUNS = {"one": ("dns", 1), "two": ("dns", 2), "scales": ("two_scale", 1)}  # name -> mode and ranks
FOUND = ("section_board", "section_package", "peel_board", "von_mises_board", "von_mises_package", "von_mises_max")


def write_package(folder: Path) -> list[str]:
    """Mesh a quarter of a package with two joints in a row, in columns; the outer joint has a void."""
    imprint = {"rings": 2, "first_layer": 0.06 * MM, "growth": 2.5}
    numerics = {"core": 2, "rings": 1, "layers": 3}
    whole = package(rows=2, standoff=0.30 * MM, joint_numerics=numerics, imprint=imprint)
    plate = board(numerics={"layers": 2, "patch_layers": 1, "coarse_size": 4.0 * MM})
    write_assembly(whole, plate, folder / "flat.msh")
    side = write_displaced_assembly(
        folder / "flat.msh", prescribed_displacement(whole, WARPAGE), folder / "assembly.msh"
    )
    joints = []
    for site in pad_table(whole, plate, WARPAGE):
        surface = barrel(site.gap, 0.04 * MM)
        if site.name == "A4":
            surface = with_void(surface, (0.03 * MM, 0.0, 0.5 * site.gap), 0.12 * MM)
        joints.append(mesh_joint(surface, site, whole, side, columns_of(site, whole, plate, side)))
    write_joints(joints, folder / "joints.msh")
    return [joint.record["method"] for joint in joints]


@pytest.fixture(scope="module")
def ended(tmp_path_factory) -> dict[str, tuple[dict, dict]]:
    """Return history and result of each run."""
    folder = tmp_path_factory.mktemp("imprinted")
    assert write_package(folder) == ["swept", "free-form"]
    meshes, inputs = [str(folder / f"{name}.msh") for name in ("assembly", "joints")], []
    for name, (mode, ranks) in RUNS.items():
        shock = SHOCK | {"ranks": {"total": ranks}}
        scene = {"mode": mode, "meshes": meshes, "shock": shock, "output": str(folder / name)}
        scene |= {"materials": {"solder": "SAC405_elastic"}}
        (folder / f"{name}.json").write_text(json.dumps(scene))
        inputs.append((ranks, folder / f"{name}.json"))
    run_programs(inputs)
    histories = {name: dict(np.load(folder / name / "history.npz")) for name in RUNS}
    return {name: (history, read_json(folder / name / "result.json")) for name, history in histories.items()}


def test_sections_are_in_balance(ended):
    for _, result in ended.values():
        assert result["health"]["section_force_residual"]["value"] < 1e-6
        assert all(check["ok"] for check in result["health"].values())


@pytest.mark.parametrize(("run", "share"), [("two", 1e-7), ("scales", 0.01)])
def test_other_ranks_and_two_scales_find_the_same(ended, run, share):
    expected, actual = ended["one"][0], ended[run][0]
    for name in FOUND:
        scale = np.abs(expected[name]).max()
        assert scale > 0.0
        assert np.abs(actual[name] - expected[name]).max() <= share * scale, name


def test_all_runs_rank_both_joints_alike(ended):
    critical = [result["metrics"]["critical_joint"]["value"] for _, result in ended.values()]
    assert len(set(critical)) == 1
