"""A run folder: the products of one case under the names that users know, as hard links to those of the store.

What the program has put there is listed in ``.store/views/<key of the folder>.json``; nothing else is ever removed.
"""

import json
import os
import shutil
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from workflow.store.point import Point
from workflow.store.product import RECORD, file_digest, read_record
from workflow.store.store import CASE, HOME, Store, write_case


@dataclass(frozen=True, slots=True)
class Shown:
    """A file of a run folder: the file of the store that it shows, relative to the store, and its SHA-256."""

    source: str
    digest: str


def show(store: Store, point: Point, stages: Iterable[str]) -> list[str]:
    """Show the products of some stages of a point in its run folder, and no others.

    Args:
        store: where the products are.
        point: whose run folder it is.
        stages: those whose products are there and intact.

    Returns:
        Files that were missing from the run folder, or were not as they were written, and have been put back.
    """
    folder = store.run_folder(point)
    wanted = _wanted(store, point, set(stages))
    before = listed(store, folder)
    write_case(folder, point.case)
    for name in before.keys() - wanted.keys():
        _withdraw(store, folder / name, before[name])
    _write_list(store, folder, wanted)
    lost = [name for name, shown in wanted.items() if before.get(name) == shown and not _shows(folder / name, shown)]
    for name, shown in wanted.items():
        _put(store, folder / name, shown, before.get(name, shown))
    return lost


def listed(store: Store, folder: Path) -> dict[str, Shown]:
    """Return what the program has put into a run folder: file -> what it shows."""
    try:
        table = json.loads(_list(store, folder).read_text(encoding="utf-8"))
        return {str(name): Shown(str(source), str(digest)) for name, (source, digest) in table.items()}
    except (OSError, ValueError, AttributeError, TypeError):
        return _recognised(store, folder)


def _recognised(store: Store, folder: Path) -> dict[str, Shown]:
    """Return the files of a run folder that hold the same as files of products, where the list of them is lost."""
    known: dict[str, Shown] = {}
    for product in (store.home / "products").glob("*"):
        files = (read_record(product) or {"files": {}})["files"]
        if (product / RECORD).is_file():
            files = files | {RECORD: file_digest(product / RECORD)}
        known |= {digest: Shown(f"products/{product.name}/{name}", digest) for name, digest in files.items()}
    own = [path for path in folder.rglob("*") if path.is_file() and HOME not in path.relative_to(folder).parts]
    digests = {path.relative_to(folder).as_posix(): file_digest(path) for path in own}
    return {name: known[digest] for name, digest in digests.items() if digest in known}


def shown_records(store: Store, point: Point) -> dict[str, dict]:
    """Return the records of the products that a run folder shows, by stage."""
    sources = {name: shown.source for name, shown in listed(store, store.run_folder(point)).items()}
    wanted = {stage.name: sources.get(stage.record) for stage in point.case.pipeline.stages}
    records = {name: read_record((store.home / source).parent) for name, source in wanted.items() if source}
    return {name: record for name, record in records.items() if record is not None}


def adopt(store: Store, folder: Path, names: Iterable[str]) -> None:
    """List files that were written into a run folder, and are of no product, as the program's."""
    own = {name: Shown(f"views/none/{name}", file_digest(folder / name)) for name in names}
    _write_list(store, folder, listed(store, folder) | own)


def withdraw_all(store: Store, folder: Path) -> None:
    """Remove all that the program has put into a run folder, and folders that are empty then."""
    for name, shown in listed(store, folder).items():
        _withdraw(store, folder / name, shown)
    (folder / CASE).unlink(missing_ok=True)
    _remove_empty(folder / CASE, folder)


def remove_unused(store: Store) -> int:
    """Remove products that no run folder shows, and what is left of work that was broken off; return how many."""
    lists = [json.loads(path.read_text(encoding="utf-8")) for path in (store.home / "views").glob("*.json")]
    shown = {Path(source).parts[1] for table in lists for source, _ in table.values()}
    unused = [path for path in (store.home / "products").glob("*") if path.name not in shown]
    unused += (store.home / "work").glob("*")
    for path in unused:
        shutil.rmtree(path)
    return len(unused)


def _list(store: Store, folder: Path) -> Path:
    return store.home / "views" / f"{'run' if folder == store.folder else folder.name}.json"


def _write_list(store: Store, folder: Path, wanted: dict[str, Shown]) -> None:
    path = _list(store, folder)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".partial")
    table = {name: [shown.source, shown.digest] for name, shown in wanted.items()}
    partial.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    partial.replace(path)


def _wanted(store: Store, point: Point, stages: set[str]) -> dict[str, Shown]:
    """Return the files of a run folder: those of each product in the folder of its stage, some also at the top."""
    found = {}
    for stage in point.case.pipeline.stages:
        product = store.product(point, stage.name)
        record = read_record(product) if stage.name in stages else None
        if record is None:
            continue
        source = product.relative_to(store.home).as_posix()
        files = record["files"] | {RECORD: file_digest(product / RECORD)}
        for name, digest in files.items():
            shown = Shown(f"{source}/{name}", digest)
            found[f"{stage.name}/{name}"] = shown
            if name in stage.on_top:
                found[name] = shown
    return found


def _put(store: Store, path: Path, shown: Shown, before: Shown) -> None:
    """Let a path show a file of the store; what stands there and is none of the program's is set aside."""
    source = store.home / shown.source
    if _same(path, source) or _shows(path, shown):
        return
    _withdraw(store, path, before)
    if os.path.lexists(path):
        _set_aside(path)
    for parent in reversed(path.relative_to(store.folder).parents):
        if (place := store.folder / parent).is_symlink() or place.is_file():
            _set_aside(place)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(source, path)
    except OSError:  # a file system without hard links
        shutil.copy2(source, path)


def _withdraw(store: Store, path: Path, shown: Shown) -> None:
    """Remove a file that the program has put there; one that a user has put in its place stays."""
    if _same(path, store.home / shown.source) or _shows(path, shown):
        path.unlink()
        _remove_empty(path, store.folder)


def _remove_empty(path: Path, top: Path) -> None:
    """Remove the folders of a file that are empty, but not the top one."""
    for folder in path.parents:
        if folder == top:
            return
        with suppress(OSError):
            folder.rmdir()


def _set_aside(path: Path) -> None:
    """Rename what a user has put where a product belongs."""
    number = 1
    while os.path.lexists(aside := path.with_name(f"{path.name}.kept-{number}")):
        number += 1
    path.rename(aside)


def _same(path: Path, source: Path) -> bool:
    """Whether two names are of one file."""
    try:
        return os.path.samestat(path.lstat(), source.lstat())
    except OSError:
        return False


def _shows(path: Path, shown: Shown) -> bool:
    """Whether a file holds what it is to show."""
    try:
        return not path.is_symlink() and path.is_file() and file_digest(path) == shown.digest
    except OSError:
        return False
