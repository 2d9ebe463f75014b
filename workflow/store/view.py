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

from reflowshock.workflow.case.stage import PAGE
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import RECORD, discard, file_digest, read_record
from reflowshock.workflow.store.store import CASE, Store, write_case

NO_PRODUCT = "views/none"  # in place of the product that a file is of


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
    _make_way(folder, CASE)
    write_case(folder, point.case)
    for name, shown in before.items():
        if wanted.get(name) != shown:
            _withdraw(store, folder, name, shown)
    _write_list(store, folder, wanted)
    lost = [name for name, shown in wanted.items() if before.get(name) == shown and not _holds(folder, name, shown)]
    for name, shown in wanted.items():
        _put(store, folder, name, shown)
    return lost


def listed(store: Store, folder: Path) -> dict[str, Shown]:
    """Return what the program has put into a run folder: file -> what it shows."""
    try:
        table = json.loads(_list(store, folder).read_text(encoding="utf-8"))
        return {str(name): Shown(str(source), str(digest)) for name, (source, digest) in table.items()}
    except (OSError, ValueError, AttributeError, TypeError):
        return _recognised(store, folder)


def _recognised(store: Store, folder: Path) -> dict[str, Shown]:
    """Return the files of a run folder that show files of products, where the list of them is lost.

    They have the names that products are shown under: a copy that a user has made under another name is the user's.
    """
    known = []
    for product in (store.home / "products").glob("*"):
        files = (read_record(product) or {"files": {}})["files"]
        if (product / RECORD).is_file():
            files = files | {RECORD: file_digest(product / RECORD)}
        stage = product.name.rpartition("-")[0]
        for name, digest in files.items():
            shown = Shown(f"products/{product.name}/{name}", digest)
            known += [(place, shown) for place in (f"{stage}/{name}", *(one for one in PAGE if one == name))]
    return {name: shown for name, shown in known if _holds(folder, name, shown)}


def shown_records(store: Store, point: Point) -> dict[str, dict]:
    """Return the records of the products that a run folder shows, by stage."""
    sources = {name: shown.source for name, shown in listed(store, store.run_folder(point)).items()}
    wanted = {stage.name: sources.get(stage.record) for stage in point.case.pipeline.stages}
    records = {name: read_record((store.home / source).parent) for name, source in wanted.items() if source}
    return {name: record for name, record in records.items() if record is not None}


def adopt(store: Store, folder: Path, made: Path) -> None:
    """Move files that are of no product to the top of a folder, and list them as the program's; such from before go.

    Args:
        store: of the folder.
        folder: of a run or study; what a user has put there under their names is set aside.
        made: the folder that holds them, and nothing else.
    """
    files = {path.name: path for path in made.iterdir()}
    before = listed(store, folder)
    own = {name: Shown(f"{NO_PRODUCT}/{name}", file_digest(path)) for name, path in files.items()}
    for name, shown in list(before.items()):
        if name in own or shown.source.startswith(NO_PRODUCT):
            _withdraw(store, folder, name, before.pop(name))
    _write_list(store, folder, before | own)
    for name, path in files.items():
        if os.path.lexists(folder / name) and not _holds(folder, name, own[name]):
            _set_aside(folder / name)
        path.rename(folder / name)


def not_as_put(store: Store, folder: Path) -> list[str]:
    """List the files that the program has put into a run folder and that are missing, or others now, in words."""
    return [
        f"{folder / name} is {'not as it was written' if os.path.lexists(folder / name) else 'missing'}"
        for name, shown in listed(store, folder).items()
        if not _holds(folder, name, shown)
    ]


def withdraw_all(store: Store) -> None:
    """Remove all that the program has put into the folders of a store, and folders that are empty then."""
    for folder in _folders(store):
        for name, shown in listed(store, folder).items():
            _withdraw(store, folder, name, shown)
        if (folder / CASE).is_file() and not _is_behind_link(folder, CASE):
            (folder / CASE).unlink()
            _remove_empty(folder / CASE, store.folder)


def remove_unused(store: Store) -> tuple[int, int]:
    """Remove products that no run folder shows, and work that was broken off; return how many of each."""
    shown = {Path(one.source).parts[1] for folder in _folders(store) for one in listed(store, folder).values()}
    products = [path for path in (store.home / "products").glob("*") if path.name not in shown]
    works = list((store.home / "work").glob("*"))
    for path in products + works:
        discard(path)
    return len(products), len(works)


def _folders(store: Store) -> list[Path]:
    """Return the folder of a store, and the run folders of its points."""
    return [store.folder, *(store.folder / "points").glob("*")]


def _list(store: Store, folder: Path) -> Path:
    return store.home / "views" / f"{'run' if folder == store.folder else folder.name}.json"


def _write_list(store: Store, folder: Path, wanted: dict[str, Shown]) -> None:
    path = _list(store, folder)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".partial")
    table = {name: [shown.source, shown.digest] for name, shown in wanted.items()}
    partial.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    if path.is_dir():
        discard(path)
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


def _put(store: Store, folder: Path, name: str, shown: Shown) -> None:
    """Let a name in a run folder show a file of the store; what stands there and is a user's is set aside."""
    if _holds(folder, name, shown):
        return
    _make_way(folder, name)
    path, source = folder / name, store.home / shown.source
    if os.path.lexists(path):
        _set_aside(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(source, path)
    except OSError:  # a file system without hard links
        shutil.copy2(source, path)


def _make_way(folder: Path, name: str) -> None:
    """Set aside what stands where the folders of a file belong, and is none or leads elsewhere; or a folder for it."""
    for parent in reversed(_parents(name)):
        place = folder / parent
        if place.is_symlink() or (place.exists() and not place.is_dir()):
            _set_aside(place)
    if (folder / name).is_dir():
        _set_aside(folder / name)


def _withdraw(store: Store, folder: Path, name: str, shown: Shown) -> None:
    """Remove a file that the program has put there; one that a user has put in its place, or written into, stays."""
    path = folder / name
    if _holds(folder, name, shown):
        path.unlink()
        _remove_empty(path, store.folder)
    elif not _is_behind_link(folder, name) and _same(path, store.home / shown.source):
        _set_aside(path)  # by an editor that keeps the file, so that the product has changed, too


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


def _holds(folder: Path, name: str, shown: Shown) -> bool:
    """Whether a run folder has what the program has put there under a name; none behind a link is."""
    return not _is_behind_link(folder, name) and _shows(folder / name, shown)


def _is_behind_link(folder: Path, name: str) -> bool:
    """Whether a folder in which a file of a run folder would be is a link, which only a user makes."""
    return any((folder / parent).is_symlink() for parent in _parents(name))


def _parents(name: str) -> tuple[Path, ...]:
    """Return the folders of a file of a run folder, the nearest first, without the run folder itself."""
    return tuple(Path(name).parents)[:-1]


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
