"""Every product file, damaged in four ways, is detected, rebuilt and equal to the first."""

import json
import random
from collections.abc import Callable
from itertools import product
from pathlib import Path

import pytest

from reflowshock.workflow.jobs.batch import show_products
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.state import examine
from reflowshock.workflow.store.store import Store
from tests.support.faults import SEED, answers, run_drop
from tests.support.products import make
from tests.support.workflow_command import SMALL_CASE


def truncate(path: Path) -> None:
    """Cut a file to half of its length."""
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def empty(path: Path) -> None:
    """Replace a file by an empty one."""
    path.write_bytes(b"")


def flip_a_bit(path: Path) -> None:
    """Flip one bit of a file, at a position that depends on the seed and on the name of the file."""
    content = bytearray(path.read_bytes())
    position = random.Random(f"{SEED} {path.name}").randrange(len(content))
    content[position] ^= 1
    path.write_bytes(bytes(content))


WAYS: dict[str, Callable[[Path], None]] = {
    "delete": Path.unlink, "empty": empty, "truncate": truncate, "flip": flip_a_bit,
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("case", ["package", "structure"])
def test_damage_of_any_file_is_noticed(tmp_path, case, way):
    file = SMALL_CASE if case == "package" else SMALL_CASE.with_name("structure.toml")
    store, point = Store(tmp_path / "run", one_run=True), Point({}, read_case(file))
    make(store, point, point.case.pipeline.names)
    show_products(store, point)
    for stage in point.case.pipeline.stages:
        folder = store.product(point, stage.name)
        for path in [path for path in folder.rglob("*") if path.is_file()]:
            original = path.read_bytes()
            WAYS[way](path)
            state = examine(store, point)[stage.name]
            assert state.stale, path
            assert path.name in state.damaged[0]
            path.write_bytes(original)
    assert not any(state.stale for state in examine(store, point).values())


@pytest.mark.parametrize("way", [way if way == "flip" else pytest.param(way, marks=pytest.mark.long) for way in WAYS])
def test_damage_heals(drop_folder, way):
    folder = drop_folder
    expected, shape = answers(folder), (folder / "reflow/shape.h5").read_bytes()
    (damaged,) = folder.glob(".store/products/reflow-*")
    for path in damaged.iterdir():
        WAYS[way](path)
    for path in (folder / "reflow").iterdir():
        path.unlink()
    refused = run_drop(folder, "report")
    assert refused.returncode == 1
    assert "product reflow is damaged" in refused.stderr
    assert run_drop(folder, "verify").returncode == 1
    assert "damaged" in run_drop(folder, "status").stdout
    healed = run_drop(folder)
    assert healed.returncode == 0, healed.stderr
    assert "product reflow is damaged" in healed.stderr
    assert "ok     reflow" in healed.stdout and "ok     report" not in healed.stdout  # equal bits: report reused
    assert run_drop(folder, "verify").returncode == 0
    assert answers(folder) == expected
    assert (folder / "reflow/shape.h5").read_bytes() == shape


BESIDE = ("inputs/case.json", ".reflowshock.json", ".store/views/run.json")
EACH_ONCE = {("delete", BESIDE[2]), ("empty", BESIDE[1]), ("truncate", BESIDE[0]), ("flip", BESIDE[1])}


@pytest.mark.parametrize(
    ("way", "name"),
    [
        pytest.param(way, name, marks=[] if (way, name) in EACH_ONCE else pytest.mark.long)
        for way, name in product(WAYS, BESIDE)
    ],
)
def test_damage_of_what_is_beside_the_products_heals(drop_folder, way, name):
    WAYS[way](drop_folder / name)
    result = run_drop(drop_folder, "run", "--force")
    assert result.returncode == 0, result.stderr
    assert run_drop(drop_folder, "verify").returncode == 0
    assert not list(drop_folder.rglob("*.kept-*"))
    assert json.loads((drop_folder / "summary.json").read_text())["case"] == "sessile_drop"
