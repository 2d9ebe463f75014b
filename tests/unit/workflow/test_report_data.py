"""Data that the script of a report draws: arrays, lines, surfaces."""

import base64
import hashlib
import json
import re
import zlib

import meshio
import numpy as np
import pytest

from reflowshock.workflow.package_report.scenes import residual_scene
from reflowshock.workflow.report.bodies import body_group
from reflowshock.workflow.report.charts import MOST_POINTS, Axis, Chart, Series, thin_samples
from reflowshock.workflow.report.colours import SCALES, colour_at, ink_on
from reflowshock.workflow.report.field_series import FieldSeries
from reflowshock.workflow.report.page_data import PageData
from reflowshock.workflow.report.scene import FINEST, Field, Group, Scene, boundary, decimate, kept_frames
from reflowshock.workflow.report.template import ASSETS, SCRIPTS, write_page

HOSTILE = '</script><script>alert("1")</script><img src=x onerror=alert(2)>\x1b[31m & "\' {{ 7*7 }}'


def box(nx: int, ny: int, nz: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and hexahedra of a unit box."""
    lines = [np.linspace(0.0, 1.0, n + 1) for n in (nx, ny, nz)]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(nx + 1, ny + 1, nz + 1)
    low, high = slice(None, -1), slice(1, None)
    corners = [number[x, y, z] for z in (low, high) for x, y in ((low, low), (high, low), (high, high), (low, high))]
    return points, np.stack(corners, axis=-1).reshape(-1, 8)


def decoded(data: dict, number: int) -> np.ndarray:
    """Return an array of the report's data by its number."""
    array = data["arrays"][number]
    return np.frombuffer(zlib.decompress(base64.b64decode(array["data"])), dtype=f"<{array['type']}")


def test_the_boundary_of_a_box_is_closed_and_points_outwards():
    points, cells = box(3, 4, 5)
    faces, cell = boundary(cells)
    assert len(faces) == 2 * (3 * 4 + 4 * 5 + 5 * 3)
    corners = points[faces]
    normal = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    assert np.einsum("fk,fk->", normal, corners.mean(axis=1)) / 3.0 == pytest.approx(1.0)  # volume by Gauss
    assert normal.sum(axis=0) == pytest.approx(np.zeros(3))
    assert set(faces[0]) <= set(cells[cell[0]])


def test_values_of_cells_are_averaged_within_each_body():
    points, cells = box(2, 1, 1)
    fields = {"part": np.array([[0.0, 1.0]])}
    series = FieldSeries(points, cells, np.zeros(1), np.zeros((1, len(points), 3)), fields)
    group = body_group("both", series, np.ones(2, bool), {"stress": np.array([[1.0, 3.0]])})
    assert len(group.points) == 16  # the nodes between two bodies belong to each
    assert np.all(group.values["stress"][0] == np.where(group.part == 0, 1.0, 3.0))


def test_a_fine_body_is_made_coarser_with_its_fields():
    points, cells = box(40, 40, 40)
    faces, _ = boundary(cells)
    part = np.zeros(len(points), int)
    fine = Group("fine", points, faces, part, displacement=points[None], values={"x": points[None, :, 0]})
    plain = Group("plain", points[:4], np.array([[0, 1, 2]]), part[:4])
    coarse, same = decimate([fine, plain], 5000)
    assert same is plain and 2000 < coarse.triangles <= 5000
    assert coarse.displacement[0] == pytest.approx(coarse.points)
    assert coarse.values["x"][0] == pytest.approx(coarse.points[:, 0])
    assert np.ptp(coarse.points, axis=0) == pytest.approx(np.ones(3), abs=0.05)


def test_a_scene_keeps_its_first_frame_and_the_values_of_its_scale():
    points, cells = box(1, 1, 1)
    faces, _ = boundary(cells)
    values = np.array([np.linspace(0.0, 2.0, 8), np.full(8, np.nan)])
    moved = np.array([0.0 * points, 1e-3 * points])
    group = Group("body", points, faces, np.zeros(8, int), displacement=moved, values={"stress": values})
    page = PageData()
    page.scene(Scene([group], ["body"], [Field("stress", "MPa", 0.0, 1.0)], ["0 ms", "1 ms"], start=1))
    data = json.loads(page.script_data())
    (scene,) = data["scenes"]
    assert scene["frames"] == ["0 ms", "1 ms"] and scene["start"] == 1
    record = scene["groups"][0]
    steps = decoded(data, record["values"][0]).reshape(2, 8)
    assert steps[0].min() == 1 and steps[0].max() == FINEST and not steps[1].any()
    displacement = record["displacement"]["scale"] * decoded(data, record["displacement"]["data"]).reshape(2, 8, 3)
    assert displacement == pytest.approx(1e3 * moved, abs=2e-5)  # mm
    assert decoded(data, record["points"]).reshape(8, 3) == pytest.approx(1e3 * points)


@pytest.mark.parametrize(("most", "indices"), [(9, [0, 1, 2, 3, 4, 5]), (3, [0, 3, 5]), (1, [3]), (0, [3])])
def test_of_too_many_frames_the_first_shown_one_stays(most, indices):
    assert kept_frames(6, most, 3) == indices


def test_a_long_line_keeps_its_peaks():
    x = np.linspace(0.0, 1.0, 100_000)
    y = np.sin(40 * x)
    y[[31_415, 27_182]] = [9.0, -9.0]
    kept_x, kept_y = thin_samples(x, y)
    assert len(kept_y) <= MOST_POINTS and (kept_y.max(), kept_y.min()) == (9.0, -9.0)
    assert (kept_x[0], kept_x[-1]) == (0.0, 1.0) and np.all(np.diff(kept_x) > 0)
    assert thin_samples(x[:10], y[:10])[1] is not None and len(thin_samples(x[:10], y[:10])[0]) == 10


def test_equal_arrays_are_kept_once():
    page, time = PageData(), np.linspace(0.0, 1.0, 5)
    page.charts([Chart(Axis("t [s]"), Axis("a [m]"), [Series("a", time, time), Series("b", time, 2 * time)])])
    data = json.loads(page.script_data())
    assert len(data["arrays"]) == 2
    assert decoded(data, data["figures"][0][0]["series"][1]["y"]) == pytest.approx(2 * time)
    with pytest.raises(ValueError, match="type f8 cannot be drawn; allowed: f4, i2, u1, u2, u4"):
        page.array(time, "f8")


def test_scales_of_colours_grow_lighter_or_have_a_light_middle():
    def light(colour: str) -> float:
        return sum(w * int(colour[k : k + 2], 16) for w, k in ((0.3, 1), (0.6, 3), (0.1, 5)))

    grey = [light(colour) for colour in SCALES["sequential"]]
    assert grey == sorted(grey)
    both = [light(colour) for colour in SCALES["diverging"]]
    assert both[:5] == sorted(both[:5]) and both[4:] == sorted(both[4:], reverse=True)
    assert (colour_at(0.0), colour_at(1.0)) == (SCALES["sequential"][0], SCALES["sequential"][-1])
    assert (ink_on("#440154"), ink_on("#fde725")) == ("#ffffff", "#000000")


PIECE = """<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece NumberOfPoints="8" NumberOfCells="1">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">{points}</DataArray></Points>
<Cells><DataArray Name="connectivity" format="ascii">0 1 2 3 4 5 6 7</DataArray>
<DataArray Name="offsets" format="ascii">8</DataArray></Cells>
<CellData><DataArray Name="vtkGhostType" format="ascii">{ghost}</DataArray>
<DataArray Name="part" format="ascii">{part}</DataArray></CellData>
<PointData><DataArray Name="displacement" format="ascii">{moved}</DataArray></PointData>
</Piece></UnstructuredGrid></VTKFile>"""


def test_series_of_several_ranks_are_read_as_one_body(tmp_path):
    points, cells = box(2, 1, 1)
    for name, cell, ghost in (("a", 0, 0), ("b", 1, 0), ("c", 0, 1)):  # the third is a copy of the first
        corners = points[cells[cell]]
        for step in range(2):
            fields = {"points": corners, "moved": step * corners}
            texts = {key: " ".join(map(str, value.ravel())) for key, value in fields.items()}
            (tmp_path / f"{name}{step}.vtu").write_text(PIECE.format(ghost=ghost, part=cell, **texts))
    for step in range(2):
        pieces = "".join(f'<Piece Source="{name}{step}.vtu" />' for name in "abc")
        (tmp_path / f"all{step}.pvtu").write_text(f"<VTKFile><PUnstructuredGrid>{pieces}</PUnstructuredGrid></VTKFile>")
    sets = "".join(f'<DataSet timestep="{step}e-3" file="all{step}.pvtu" />' for step in range(2))
    (tmp_path / "all.pvd").write_text(f"<VTKFile><Collection>{sets}</Collection></VTKFile>")
    series = FieldSeries.read([tmp_path / "all.pvd"], ("part", "von_mises"))
    assert (len(series.points), len(series.cells)) == (12, 2) and "von_mises" not in series.fields
    assert series.fields["part"].tolist() == [[0.0, 1.0], [0.0, 1.0]]
    assert series.displacement[1] == pytest.approx(series.points) and series.nearest(0.9e-3) == 1
    assert len(boundary(series.cells)[0]) == 10
    assert series.at(np.array([0.8e-3])).displacement == pytest.approx(series.displacement[1:])


def test_what_cooling_left_is_shown_by_part(tmp_path):
    points, cells = box(4, 1, 1)
    parts = ["board", "solder@A1", "copper_board@A1", "substrate"]
    data = {"von_mises": [np.array([0.0, 4e6, 2e6, 0.0])], "part": [np.arange(4)]}
    mesh = meshio.Mesh(1e-3 * points, [("hexahedron", cells)], {"displacement": 1e-6 * points}, data)
    mesh.write(tmp_path / "residual.vtu")
    scene = residual_scene(tmp_path / "residual.vtu", parts, 3e6)
    assert [(group.name, group.is_ghost) for group in scene.groups] == [
        ("solder", False), ("copper", False), ("board", True), ("substrate", True),
    ]  # fmt: skip
    assert scene.groups[0].values["von Mises stress"] == pytest.approx(4.0) and scene.fields[0].high == 3.0
    assert scene.fields[1].unit == "µm" and len(PageData().scene(scene)) > 0


def page_of(tmp_path, **context) -> str:
    """Return the HTML of a report with hostile texts; ``context`` replaces parts."""
    content = {"case": {"title": HOSTILE, "name": "x"}, "curves": {}, "scenes": {}, "pictures": {}, "healthy": True}
    tables = {"parameters": {"head": ["key", "value"], "rows": [[HOSTILE, HOSTILE]]},
              "effects": {"head": ["effect"], "rows": []}, "versions": {"head": ["library"], "rows": []}}  # fmt: skip
    write_page(tmp_path / "report.html", "report.html.j2", content | {"tables": tables} | context)
    return (tmp_path / "report.html").read_text()


def test_no_text_of_a_case_becomes_code(tmp_path):
    line = Series(HOSTILE, [0.0, 1.0], [0.0, 1.0], labels=[HOSTILE, HOSTILE])
    scene = Scene([Group(HOSTILE, np.eye(3), np.array([[0, 1, 2]]), np.zeros(3, int))], [HOSTILE])
    page = page_of(
        tmp_path,
        curves={"histories": [Chart(Axis(HOSTILE), Axis(HOSTILE), [line], HOSTILE)]},
        scenes={"view": scene},
        warnings=[HOSTILE],
        answer=HOSTILE,
        verdict={"design": HOSTILE},
        timings={HOSTILE: 1.0},
        maps=[{"label": HOSTILE, "size": (1, 1), "scale": [], "cells": [{"name": HOSTILE, "x": 0.5, "y": 0.5}]}],
    )
    without_data = re.sub(r'<script type="application/json".*?</script>', "", page, flags=re.DOTALL)
    assert page.count("<script") == 2 and without_data.count("</script>") == 1
    assert "<img src=x" not in page and "\x1b" not in page and "7*7" in page
    data = json.loads(re.search(r'id="page-data">(.*?)</script>', page, re.DOTALL)[1])
    assert data["figures"][0][0]["title"] == HOSTILE.replace("\x1b", "\\x1b")


def test_a_page_allows_its_own_script_and_nothing_else(tmp_path):
    page = page_of(tmp_path)
    policy = re.search(r'Content-Security-Policy" content="(.*?)"', page)[1].replace("&#39;", "'")
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'" and rules["img-src"] == "data:"
    for tag, rule in (("script", "script-src"), ("style", "style-src")):
        text = re.search(f"<{tag}>(.*?)</{tag}>", page, re.DOTALL)[1]
        assert rules[rule] == f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
    assert not re.search(r"<[^>]*\s(style|on\w+)=", re.sub("<script.*?</script>", "", page, flags=re.DOTALL))
    assert not re.search(r'(src|href)="(?!data:|#)', page)


def test_a_page_without_results_lists_missing_stages(tmp_path):
    page = page_of(tmp_path, not_run=["surface", "shock"], healthy=False, missed=["energy balance error"])
    assert "This run is incomplete; stages not run: surface, shock." in page
    assert "A health check failed: energy balance error." in page


def test_own_scripts_are_short():
    lengths = {name: len((ASSETS / name).read_text().splitlines()) for name in SCRIPTS if ".min." not in name}
    assert max(lengths.values()) <= 400, lengths
