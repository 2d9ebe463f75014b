"""Every file of every product, damaged in four ways, is noticed; what is damaged is made again and equals the first."""

import json
import random
import shutil
from collections.abc import Callable
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
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def empty(path: Path) -> None:
    path.write_bytes(b"")


def flip_a_bit(path: Path) -> None:
    content = bytearray(path.read_bytes())
    place = random.Random(f"{SEED} {path.name}").randrange(len(content))
    content[place] ^= 1
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
        product = store.product(point, stage.name)
        for path in [path for path in product.rglob("*") if path.is_file()]:
            kept = path.read_bytes()
            WAYS[way](path)
            state = examine(store, point)[stage.name]
            assert state.stale, path
            assert path.name in state.damaged[0]
            path.write_bytes(kept)
    assert not any(state.stale for state in examine(store, point).values())


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed") / "run"
    assert run_drop(folder).returncode == 0
    return folder


@pytest.mark.parametrize("way", [way if way == "flip" else pytest.param(way, marks=pytest.mark.long) for way in WAYS])
def test_damage_heals(undisturbed, tmp_path, way):
    folder = tmp_path / "run"
    shutil.copytree(undisturbed, folder)
    (product,) = folder.glob(".store/products/reflow-*")
    for path in product.iterdir():
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
    assert "ok     reflow" in healed.stdout and "ok     report" not in healed.stdout  # the same bits: the report stays
    assert run_drop(folder, "verify").returncode == 0
    assert answers(folder) == answers(undisturbed)
    assert (folder / "reflow/shape.h5").read_bytes() == (undisturbed / "reflow/shape.h5").read_bytes()


@pytest.mark.parametrize("name", ["inputs/case.json", ".reflowshock.json", ".store/views/run.json"])
@pytest.mark.parametrize("way", WAYS)
def test_damage_of_what_is_beside_the_products_heals(undisturbed, tmp_path, name, way):
    folder = tmp_path / "run"
    shutil.copytree(undisturbed, folder)
    WAYS[way](folder / name)
    result = run_drop(folder, "run", "--force")
    assert result.returncode == 0, result.stderr
    assert run_drop(folder, "verify").returncode == 0
    assert not list(folder.rglob("*.kept-*"))
    assert json.loads((folder / "summary.json").read_text())["case"] == "sessile_drop"
