"""Report of the full chain, and of a run that ended after the reflow."""

import shutil

from reflowshock.workflow.pipeline.points import read_case_of_run
from reflowshock.workflow.pipeline.report import write_report
from tests.support.chain_products import add_chain
from tests.support.workflow_command import reflowshock

LATER = ("surface", "solder_mesh", "shock")


def test_the_report_tells_warpage_shape_effect_and_interface(run_folder):
    add_chain(run_folder)
    (run_folder / "report.html").unlink()
    write_report(run_folder, read_case_of_run(run_folder), run_folder)
    page = (run_folder / "report.html").read_text()
    sections = ("Result", "Ranked joints", "3D view", "Shock", "Effect of joint shapes", "Stress at the package pads",
                "Warpage", "Joint shapes", "Joint meshes", "Two scales", "Energy balance", "Cost")  # fmt: skip
    places = [page.index(f"<h2>{section}</h2>") for section in sections]
    assert places == sorted(places)
    assert "The real shapes lower the peak peel stress" in page
    assert "published: two-scale" in page and "0.285" in page
    assert "Largest peel stress first" in page
    assert len(page) < 12e6


def test_without_such_effects_there_are_no_such_sections(first_run):
    page = (first_run[0] / "report.html").read_text()
    for section in ("Warpage", "Effect of joint shapes", "Stress at the package pads"):
        assert f"<h2>{section}</h2>" not in page


def test_a_run_that_ended_after_the_reflow_has_a_report(run_folder):
    for stage in LATER:
        (product,) = run_folder.glob(f".store/products/{stage}-*")
        shutil.rmtree(product)
    assert reflowshock("report", run_folder).returncode == 0
    page = (run_folder / "report.html").read_text()
    assert "<h2>Joint shapes</h2>" in page and "standoff over the array" in page and "Joint shapes in the array" in page
    assert "This run is incomplete; stages not run: surface, solder_mesh, shock." in page
    assert "<h2>Joint meshes</h2>" not in page and "<h2>Shock</h2>" not in page
    assert not (run_folder / "shock").exists()
    assert reflowshock("run", run_folder, "--until", "surface").returncode == 0
    assert not list(run_folder.glob("*.kept-*")) and not (run_folder / "report.html").exists()
