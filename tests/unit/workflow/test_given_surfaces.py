"""Surfaces from files instead of reflow: they are validated by key before anything runs."""

import re
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import MM
from reflowshock.cases.hard.trials.surfaces import barrel, bridged_pair, revolve
from reflowshock.meshing.board.assembly import write_assembly
from reflowshock.meshing.board.pads import pad_table, write_pads
from reflowshock.meshing.board.parameters import Warpage
from reflowshock.meshing.core.facets import outlines
from reflowshock.meshing.surface.closed_surface import enclosed_volume, read_surface
from reflowshock.particles.scenes.products import write_shapes
from reflowshock.particles.steps.shape import JointShape, Snapshot
from reflowshock.workflow.board_drop.fine_joints import needs_coarse_joints
from reflowshock.workflow.board_drop.joint_meshes import mesh_real_joints, write_surfaces
from reflowshock.workflow.case.fields import display_values
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.run import Run
from reflowshock.workflow.package import findings
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.template import case_text
from reflowshock.workflow.process.products import write_json
from reflowshock.workflow.store.keys import stage_inputs
from tests.support.workflow_command import SMALL_CASE


@pytest.fixture
def case_file(tmp_path) -> Path:
    """A case next to a surface of A4, another 10 % wider than the reflowed ones."""
    shutil.copy(SMALL_CASE, tmp_path / "case.toml")
    shape = barrel(0.35 * MM, 0.06 * MM)
    low, wrong = barrel(0.25 * MM, 0.06 * MM), shape.triangles.copy()
    wrong[7, 1] = len(shape.points) + 5
    for name, points, triangles in (
        ("a4.stl", shape.points, shape.triangles),
        ("low.ply", low.points, low.triangles),
        ("index.ply", shape.points, wrong),
    ):
        meshio.write(tmp_path / name, meshio.Mesh(points / MM, [("triangle", triangles)]))
    return tmp_path / "case.toml"


def read(case_file: Path, **surfaces: str):
    """Return a case whose joints have surfaces from files, by joint name."""
    settings = [f'package.surfaces.{name}="{path}"' for name, path in surfaces.items()]
    return read_case(case_file, ["package.standoff=0.35 mm", "warpage.corner=0 mm", *settings])


def test_files_are_relative_to_the_case_and_identified_by_content(case_file):
    case = read(case_file, A4="a4.stl")
    assert case.files["package.surfaces.A4"] == case_file.parent / "a4.stl"
    assert display_values(case)["package.surfaces.A4"] == str(case_file.parent / "a4.stl")
    before = stage_inputs(case, case.pipeline["surface"])
    with (case_file.parent / "a4.stl").open("ab") as file:
        file.write(b" ")
    assert stage_inputs(case, case.pipeline["surface"]) != before


def test_a_case_with_them_can_be_written_as_a_template(case_file):
    case = read(case_file, A4="a4.stl")
    table = tomllib.loads(case_text(case, "small"))
    assert table["package"]["surfaces"] == {"A4": str(case_file.parent / "a4.stl")}


@pytest.mark.parametrize(
    ("name", "path", "message"),
    [
        ("A44", "a4.stl", r"package\.surfaces\.A44.*not a joint.*A4"),
        ("A4", "case.toml", r"package\.surfaces\.A4.*unknown file format.*\.stl, \.ply, \.vtu"),
        ("A4", "a5.stl", r"package\.surfaces\.A4.*does not exist"),
        ("A4", "low.ply", r"package\.surfaces\.A4.*its flat ends are .* m apart, allowed"),
        ("A4", "index.ply", r"package\.surfaces\.A4.*triangle 7 has the vertices .*, allowed 0 to"),
    ],
)
def test_what_does_not_fit_is_refused_by_key(case_file, name, path, message):
    with pytest.raises(CaseError) as caught:
        read(case_file, **{name: path})
    assert any(re.search(message, f"{p.key} {p.message} {p.allowed} {p.hint}") for p in caught.value.problems)


def shape_of(surface, arrays) -> JointShape:
    """Return the shape of a joint with a closed surface and its arrays."""
    points, triangles, lower, upper = arrays
    nothing = np.zeros((len(points), 3))
    metrics = {"volume": (enclosed_volume(surface), "m^3")}
    return JointShape(
        points,
        nothing,
        nothing[:, 0],
        points,
        triangles,
        (lower, upper),
        {"step": np.zeros(1)},
        [Snapshot(0.0, points, triangles)],
        metrics,
        "ok",
    )


@pytest.fixture
def run(case_file) -> Run:
    """A run folder whose reflow ended with barrels, and with A3 and B3 bridged."""
    case = read_case(case_file, ["warpage.corner=0 mm", 'package.surfaces.A4="a4.stl"', "package.standoff=0.35 mm"])
    folder = case_file.parent / "run"
    for name in ("geometry", "reflow", "surface", "solder_mesh"):
        (folder / name).mkdir(parents=True)
    write_assembly(case.package, case.board, folder / "geometry/assembly.msh")
    sites = pad_table(case.package, case.board, Warpage())
    write_pads(folder / "reflow/pads.json", sites)
    arrays = revolve(np.full(9, 0.24 * MM), 0.35 * MM)
    pair = bridged_pair(0.35 * MM, 1.0 * MM, 0.34 * MM, 0.1 * MM)
    free = pair.triangles[pair.boundary == 0]
    rings = [line.astype(np.int32) for line in outlines(free)]
    single = shape_of(barrel(0.35 * MM, 0.0), arrays)
    both = replace(
        single,
        surface_points=pair.points,
        triangles=free,
        rings=tuple(rings),
        verdict="bridged",
        points=pair.points,
        velocity=np.zeros_like(pair.points),
        pressure=np.zeros(len(pair.points)),
        metrics={"volume": (enclosed_volume(pair), "m^3")},
    )
    write_shapes(folder / "reflow/shapes.h5", {"A3": single, "A3+B3": both})
    verdicts = {"A3": "bridged", "A4": "ok", "B3": "bridged", "B4": "ok"}
    records = {
        name: {"shape": "A3", "verdict": verdict, "turn": 0.0, "mirror": False} for name, verdict in verdicts.items()
    }
    write_json(folder / "reflow/joints.json", records)
    return Run(folder, case, 1)


def test_given_reflowed_and_bridged_surfaces_are_written_and_meshed(run):
    measures = write_surfaces(run, run.folder / "surface")
    assert set(measures) == {"A4", "B4", "A3+B3"}
    assert measures["A4"]["max_width"] == pytest.approx(0.6 * MM, rel=0.02)
    assert measures["B4"]["max_width"] == pytest.approx(0.48 * MM, rel=0.02)
    result = findings.of_surface(measures)
    assert result.health["surface_volume_error_max"]["ok"]
    assert result.metrics["given_surface_volume_change_max"]["value"] < 1e-5  # the gap is the surface's own
    measures["A4"]["volume_change"] = -0.07
    assert findings.of_surface(measures).metrics["given_surface_volume_change_max"]["value"] == 0.07
    surface = read_surface(run.folder / "surface/A4.vtu")
    assert enclosed_volume(surface) == pytest.approx(measures["A4"]["volume"])
    coarse = needs_coarse_joints(run.case.shock.coupling)
    qualities = mesh_real_joints(run.case, run.folder, run.folder / "solder_mesh", coarse=coarse)
    assert set(qualities[""]) == {"A4", "B4"} and set(qualities["bridged_"]) == {"A3+B3"}
    assert (run.folder / "solder_mesh/free_form_A3+B3.msh").exists()
    result = findings.of_solder_mesh(qualities, {})
    assert all(check["ok"] for check in result.health.values())
