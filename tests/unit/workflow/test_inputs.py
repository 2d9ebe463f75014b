"""Staleness by content."""

import json
import os
from pathlib import Path

import pytest

from tests.support.workflow_command import SMALL_CASE, WHO_COMPUTES
from workflow.case import read_case
from workflow.inputs import compare, examine, read_case_of_run, stage_inputs, write_inputs
from workflow.stage_table import BOARD_DROP

NAMES = BOARD_DROP.names
AFTER = {name: NAMES[NAMES.index(name) :] for name in NAMES}
RERUN = {
    "shock.peak_acceleration=1000 G": ("shock", "report"),
    "shock.pulse_duration=1 ms": ("shock", "report"),
    "materials.die.young_modulus=130 GPa": ("shock", "report"),
    "materials.solder.young_modulus=40 GPa": AFTER["solder_mesh"],
    "solder.surface_tension=0.5 N/m": AFTER["reflow"],
    "warpage.corner=0.03 mm": AFTER["reflow"],
    "package.joint_numerics.layers=8": AFTER["solder_mesh"],
    "package.die.thickness=0.3 mm": ("geometry", "solder_mesh", "shock", "report"),
    "board.numerics.coarse_size=4 mm": ("geometry", "solder_mesh", "shock", "report"),
    "case.title=Another": ("report",),
}


@pytest.fixture
def case():
    return read_case(SMALL_CASE)


def complete(folder: Path, case, names=NAMES) -> None:
    """Write records and empty products, as if the stages had run one after the other."""
    write_inputs(folder, case)
    for name in names:
        stage = BOARD_DROP[name]
        record = {"seconds": 1.0, "metrics": {}, "health": {}, "effects": {}, "inputs": stage_inputs(case, stage)}
        for product in (*stage.products, stage.record):
            path = folder / product
            path.parent.mkdir(exist_ok=True)
            path.write_text("")
        (folder / stage.record).write_text(json.dumps(record))
        moment = 1_500_000_000 + NAMES.index(name)
        for product in (*stage.products, stage.record):
            os.utime(folder / product, (moment, moment))


def stale(folder: Path, case) -> tuple[str, ...]:
    return tuple(name for name, verdict in examine(folder, case).items() if verdict.stale)


def test_every_parameter_belongs_to_a_stage(case):
    used = {key for stage in BOARD_DROP.stages for key in stage_inputs(case, stage)}
    from workflow.fields import leaves

    assert {key for key, _, _ in leaves(case)} == used | WHO_COMPUTES
    assert not used & WHO_COMPUTES


def test_nothing_was_run(tmp_path, case):
    assert stale(tmp_path, case) == NAMES
    assert all(verdict.missing for verdict in examine(tmp_path, case).values())


def test_all_is_up_to_date(tmp_path, case):
    complete(tmp_path, case)
    assert stale(tmp_path, case) == ()
    assert read_case_of_run(tmp_path) == case


@pytest.mark.parametrize(("setting", "names"), RERUN.items(), ids=RERUN.keys())
def test_only_what_depends_on_a_value_is_stale(tmp_path, case, setting, names):
    complete(tmp_path, case)
    assert stale(tmp_path, read_case(SMALL_CASE, [setting])) == names


def test_the_changed_key_is_named(tmp_path, case):
    complete(tmp_path, case)
    verdicts = examine(tmp_path, read_case(SMALL_CASE, ["shock.peak_acceleration=1000 G"]))
    (change,) = verdicts["shock"].changes
    assert change.key == "shock.peak_acceleration"
    assert (change.old, change.new) == pytest.approx((14709.975, 9806.65))
    assert verdicts["report"].because_of == ("shock",)


def test_an_interrupted_rerun_is_continued(tmp_path, case):
    complete(tmp_path, case)
    moment = 1_500_000_100
    os.utime(tmp_path / BOARD_DROP["reflow"].record, (moment, moment))
    assert stale(tmp_path, case) == ("surface", "solder_mesh", "shock", "report")


def test_a_lost_product_is_made_again(tmp_path, case):
    complete(tmp_path, case)
    (tmp_path / "solder_mesh/joints.msh").unlink()
    assert stale(tmp_path, case) == ("solder_mesh", "shock", "report")


def test_inputs_are_rewritten_only_when_they_change(tmp_path, case):
    complete(tmp_path, case)
    write_inputs(tmp_path, case)
    before = {stage.name: (tmp_path / stage.inputs).stat().st_mtime_ns for stage in BOARD_DROP.stages}
    write_inputs(tmp_path, read_case(SMALL_CASE, ["shock.peak_acceleration=1000 G"]))
    after = {stage.name: (tmp_path / stage.inputs).stat().st_mtime_ns for stage in BOARD_DROP.stages}
    assert [name for name in NAMES if after[name] != before[name]] == ["shock"]
    assert after["shock"] > (tmp_path / BOARD_DROP["shock"].record).stat().st_mtime_ns


def test_a_value_that_returns_makes_nothing_stale(tmp_path, case):
    complete(tmp_path, case)
    write_inputs(tmp_path, read_case(SMALL_CASE, ["shock.peak_acceleration=1000 G"]))
    write_inputs(tmp_path, case)
    stage = BOARD_DROP["shock"]
    assert (tmp_path / stage.inputs).stat().st_mtime <= (tmp_path / stage.record).stat().st_mtime


def test_compare_names_new_changed_and_lost_keys():
    changes = compare({"a": 1, "b": 2, "c": 3}, {"a": 1, "b": 5, "d": 4})
    assert [(change.key, change.old, change.new) for change in changes] == [
        ("b", 2, 5), ("d", None, 4), ("c", 3, None),
    ]  # fmt: skip
