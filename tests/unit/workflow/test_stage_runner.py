"""Running a stage: a product is complete or absent, and inputs must not change while it is built."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from reflowshock.workflow.case.run import Findings, Run, StageError
from reflowshock.workflow.case.text import against_limit
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.stage_runner import execute, run_stage
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import MESSAGE, TRACEBACK, Store
from tests.support.products import make, record_of
from tests.support.workflow_command import SMALL_CASE


@pytest.fixture
def run(tmp_path):
    """Return a run of the shortened case in a temporary folder."""
    record_of(tmp_path / "reflow")
    return Run(tmp_path, read_case(SMALL_CASE), cores=1)


@pytest.fixture
def product(tmp_path):
    """Return the path of a product that does not exist."""
    return tmp_path / "products/surface-1"


def write_surfaces(_run: Run, folder: Path) -> Findings:
    """Write a file as a stage does; return a metric and a failed check."""
    (folder / "surfaces.json").write_text("{}")
    return Findings(
        metrics={"volume": {"value": 1.0, "unit": "m^3"}},
        health={"volume_error": {"value": 0.2, "limit": 0.1, "ok": False}},
    )


def fail(_run: Run, folder: Path) -> Findings:
    """Write half a file as a stage does and raise ValueError."""
    (folder / "surfaces.json").write_text("half")
    raise ValueError("no surface")


def test_a_stage_leaves_products_and_a_record(run, product):
    record = run_stage("surface", write_surfaces, run, product)
    written = json.loads((product / "stage.json").read_text())
    assert written == record
    assert written["key"] == "1"
    assert set(written["reads"]) == {"reflow"}
    assert set(written["files"]) == {"surfaces.json"}
    assert written["metrics"]["volume"] == {"value": 1.0, "unit": "m^3"}
    assert written["seconds"] >= 0.0
    assert sorted(path.name for path in run.folder.iterdir()) == ["products", "reflow"]


def test_processor_time_of_programs_that_a_stage_starts_is_counted(run, product):
    busy = "import time\nwhile time.process_time() < 0.2: pass"

    def start(run: Run, folder: Path) -> Findings:
        subprocess.run([sys.executable, "-c", busy], check=True)
        return write_surfaces(run, folder)

    assert run_stage("surface", start, run, product)["core_seconds"] >= 0.2


def test_a_failed_stage_leaves_no_product(run, product):
    with pytest.raises(ValueError, match="no surface"):
        run_stage("surface", fail, run, product)
    assert not product.exists()
    assert not execute("surface", fail, run, product)
    assert (run.folder / ".surface.partial" / MESSAGE).read_text() == "ValueError: no surface"
    assert "no surface" in (run.folder / ".surface.partial" / TRACEBACK).read_text()


def test_a_rerun_replaces_all_of_a_product(run, product):
    run_stage("surface", write_surfaces, run, product)
    (product / "old.vtu").write_text("old")
    (run.folder / ".surface.partial").mkdir()
    run_stage("surface", write_surfaces, run, product)
    assert not (product / "old.vtu").exists()


def test_a_stage_that_does_not_write_what_it_is_to_write_has_failed(run, product):
    with pytest.raises(StageError, match=r"has not written surface/surfaces\.json"):
        run_stage("surface", lambda *_: Findings(), run, product)
    assert not product.exists()


def test_a_product_that_changes_while_a_stage_reads_it_is_noticed(run, product):
    def change(run: Run, folder: Path) -> Findings:
        (run.folder / "reflow/more.txt").write_text("more")
        record_of(run.folder / "reflow")
        return write_surfaces(run, folder)

    with pytest.raises(StageError, match="a product that the stage reads has changed"):
        run_stage("surface", change, run, product)


def test_a_file_of_the_case_that_changes_while_a_stage_is_at_work_is_noticed(run, product, tmp_path):
    surface = tmp_path / "A1.stl"
    surface.write_text("first")
    package = run.case.package.model_copy(update={"surfaces": {"A1": str(surface)}})
    run = replace(run, case=run.case.model_copy(update={"package": package}))

    def change(run: Run, folder: Path) -> Findings:
        surface.write_text("second")
        return write_surfaces(run, folder)

    with pytest.raises(StageError, match=r"package\.surfaces\.A1: the file changed"):
        run_stage("surface", change, run, product)


def test_a_file_of_the_case_that_changes_before_a_stage_begins_is_noticed(tmp_path):
    """The key of the product follows from the file's content when the command started."""
    surface = tmp_path / "A1.stl"
    surface.write_text("first")
    case = read_case(SMALL_CASE)
    package = case.package.model_copy(update={"surfaces": {"A1": str(surface)}})
    store, point = Store(tmp_path / "run", one_run=True), Point({}, case.model_copy(update={"package": package}))
    make(store, point, ("geometry",))
    surface.write_text("second")
    with pytest.raises(StageError, match=r"a file of the case.*has changed since the command"):
        make(store, point, ("reflow",))
    assert not store.product(point, "reflow").exists()
    surface.write_text("first")
    make(store, point, point.case.pipeline.names[1:])


def test_an_interrupt_that_compiled_code_wraps_is_one(run, product):
    def interrupted(_run: Run, _folder: Path):
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    with pytest.raises(KeyboardInterrupt):
        execute("surface", interrupted, run, product)


def test_checks_of_quantities_have_their_unit():
    assert against_limit("dns_peel_stress", {"value": 5.2e6, "limit": 1e6}) == ("5.2 MPa", "1 MPa")
    assert against_limit("frequency_1_high", {"value": 273.47, "limit": 350.0}) == ("273.5 Hz", "350 Hz")
    assert against_limit("swing_frequency_error", {"value": 0.004, "limit": 0.02}) == ("0.004", "0.02")
