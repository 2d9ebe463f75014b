"""View of the store as a run folder: the products of one case under readable names, as hard links into the store.

Links and files of the program are listed in ``.store/views/<key of the folder>.json``; nothing else is ever removed.
"""

import json
import os
import shutil
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from reflowshock.workflow.case.stage import PAGE
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import RECORD, discard, file_digest, read_record
from reflowshock.workflow.store.store import CASE, Store, write_case

NO_PRODUCT = "views/none"  # source of files that belong to no product


@dataclass(frozen=True, slots=True)
class Link:
    """Link from a run folder to a file of the store: path relative to the store, and SHA-256."""

    source: str
    digest: str


Companions = Mapping[str, tuple[Point, Iterable[str]]]


def show(store: Store, point: Point, stages: Iterable[str], companions: Companions | None = None) -> list[str]:
    """Link the products of some stages of a point into its run folder and remove all other links.

    Args:
        store: Store: the folder of all products of a run or study.
        point: Point of the run folder.
        stages: Stages whose products exist and are intact.
        companions: Folder in the run folder -> companion and its intact stages.

    Returns:
        Names of files that were missing or modified in the run folder and have been restored.
    """
    folder = store.run_folder(point)
    links = _expected_links(store, point, set(stages))
    for name, (companion, intact) in (companions or {}).items():
        products = _expected_links(store, companion, set(intact))
        links |= {f"{name}/{path}": link for path, link in products.items() if "/" in path}
    before = list_program_files(store, folder)
    _clear_path(folder, CASE)
    write_case(folder, point.case)
    for name, link in before.items():
        if links.get(name) != link:
            _remove_link(store, folder, name, link)
    _write_list(store, folder, links)
    restored = [name for name, link in links.items() if before.get(name) == link and not _is_intact(folder, name, link)]
    for name, link in links.items():
        _place_link(store, folder, name, link)
    return restored


def list_program_files(store: Store, folder: Path) -> dict[str, Link]:
    """Return the files of the program in a run folder, by path relative to it.

    Args:
        store: Store with the list of these files; if it is lost, they are recognised by their content.
        folder: Folder of a run or study.

    Returns:
        Path -> its source in the store and its digest.
    """
    try:
        table = json.loads(_list(store, folder).read_text(encoding="utf-8"))
        return {str(name): Link(str(source), str(digest)) for name, (source, digest) in table.items()}
    except (OSError, ValueError, AttributeError, TypeError):
        return _recognised(store, folder)


def _recognised(store: Store, folder: Path) -> dict[str, Link]:
    """Recover the links of a run folder by content if their list is lost.

    Only the standard names of products are considered; a copy under another name belongs to the user.
    """
    candidates = []
    for product in (store.home / "products").glob("*"):
        files = (read_record(product) or {"files": {}})["files"]
        if (product / RECORD).is_file():
            files = files | {RECORD: file_digest(product / RECORD)}
        stage = product.name.rpartition("-")[0]
        for name, digest in files.items():
            link = Link(f"products/{product.name}/{name}", digest)
            candidates += [(path, link) for path in (f"{stage}/{name}", *(page for page in PAGE if page == name))]
    return {name: link for name, link in candidates if _is_intact(folder, name, link)}


def shown_records(store: Store, point: Point) -> dict[str, dict]:
    """Return the records of the products that a run folder shows.

    Args:
        store: Store: the folder of all products of a run or study.
        point: Case with its settings, which determines the run folder.

    Returns:
        Stage name -> content of its ``stage.json``; stages without a product are left out.
    """
    sources = {name: link.source for name, link in list_program_files(store, store.run_folder(point)).items()}
    source_by_stage = {stage.name: sources.get(stage.record) for stage in point.case.pipeline.stages}
    records = {name: read_record((store.home / source).parent) for name, source in source_by_stage.items() if source}
    return {name: record for name, record in records.items() if record is not None}


def adopt(store: Store, folder: Path, made: Path) -> None:
    """Move files that belong to no product to the top of a folder, replacing earlier files of this kind.

    Args:
        store: Store of the folder.
        folder: Folder of a run or study; files of the user with the same names are renamed.
        made: Folder that contains exactly the files to move.
    """
    files = {path.name: path for path in made.iterdir()}
    before = list_program_files(store, folder)
    links = {name: Link(f"{NO_PRODUCT}/{name}", file_digest(path)) for name, path in files.items()}
    for name, link in list(before.items()):
        if name in links or link.source.startswith(NO_PRODUCT):
            _remove_link(store, folder, name, before.pop(name))
    _write_list(store, folder, before | links)
    for name, path in files.items():
        if os.path.lexists(folder / name) and not _is_intact(folder, name, links[name]):
            _set_aside(folder / name)
        path.rename(folder / name)


def altered_files(store: Store, folder: Path) -> list[str]:
    """List missing or modified files of the program in a run folder as messages; empty if all are intact.

    Args:
        store: Store of the products, with the digests of the files.
        folder: Run folder.
    """
    return [
        f"{folder / name} {'was modified' if os.path.lexists(folder / name) else 'is missing'}"
        for name, link in list_program_files(store, folder).items()
        if not _is_intact(folder, name, link)
    ]


def remove_all_links(store: Store) -> None:
    """Remove all files of the program from the run folders of a store, and then empty folders; products stay.

    Args:
        store: Store of a run or study.
    """
    for folder in _folders(store):
        for name, link in list_program_files(store, folder).items():
            _remove_link(store, folder, name, link)
        if (folder / CASE).is_file() and not _is_behind_link(folder, CASE):
            (folder / CASE).unlink()
            _remove_empty(folder / CASE, store.folder)


def remove_unused(store: Store) -> tuple[int, int]:
    """Remove products that no run folder shows, and work folders of interrupted stages.

    Args:
        store: Store of a run or study.

    Returns:
        Number of removed products, and number of removed work folders.
    """
    linked = {
        Path(link.source).parts[1] for folder in _folders(store) for link in list_program_files(store, folder).values()
    }
    products = [path for path in (store.home / "products").glob("*") if path.name not in linked]
    works = list((store.home / "work").glob("*"))
    for path in products + works:
        discard(path)
    return len(products), len(works)


def _folders(store: Store) -> list[Path]:
    """Return the folder of a store and the run folders of its points."""
    return [store.folder, *(store.folder / "points").glob("*")]


def _list(store: Store, folder: Path) -> Path:
    return store.home / "views" / f"{'run' if folder == store.folder else folder.name}.json"


def _write_list(store: Store, folder: Path, links: dict[str, Link]) -> None:
    path = _list(store, folder)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".partial")
    table = {name: [link.source, link.digest] for name, link in links.items()}
    partial.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    if path.is_dir():
        discard(path)
    partial.replace(path)


def _expected_links(store: Store, point: Point, stages: set[str]) -> dict[str, Link]:
    """Return the links that a run folder should contain: one folder per stage, some files also at the top."""
    links = {}
    for stage in point.case.pipeline.stages:
        product = store.product(point, stage.name)
        record = read_record(product) if stage.name in stages else None
        if record is None:
            continue
        source = product.relative_to(store.home).as_posix()
        files = record["files"] | {RECORD: file_digest(product / RECORD)}
        for name, digest in files.items():
            link = Link(f"{source}/{name}", digest)
            links[f"{stage.name}/{name}"] = link
            if name in stage.on_top:
                links[name] = link
    return links


def _place_link(store: Store, folder: Path, name: str, link: Link) -> None:
    """Link a file of the store into a run folder; a user's file with the same name is renamed."""
    if _is_intact(folder, name, link):
        return
    _clear_path(folder, name)
    path, source = folder / name, store.home / link.source
    if os.path.lexists(path):
        _set_aside(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(source, path)
    except OSError:  # a file system without hard links
        shutil.copy2(source, path)


def _clear_path(folder: Path, name: str) -> None:
    """Rename files and links that occupy the parent folders of a file, or a folder with its name."""
    for parent in reversed(_parents(name)):
        path = folder / parent
        if path.is_symlink() or (path.exists() and not path.is_dir()):
            _set_aside(path)
    if (folder / name).is_dir():
        _set_aside(folder / name)


def _remove_link(store: Store, folder: Path, name: str, link: Link) -> None:
    """Remove a file of the program; a file that the user has replaced or modified stays."""
    path = folder / name
    if _is_intact(folder, name, link):
        path.unlink()
        _remove_empty(path, store.folder)
    elif not _is_behind_link(folder, name) and _same(path, store.home / link.source):
        _set_aside(path)  # edited in place, so that the product has changed, too


def _remove_empty(path: Path, top: Path) -> None:
    """Remove the empty parent folders of a file, except the top one."""
    for folder in path.parents:
        if folder == top:
            return
        with suppress(OSError):
            folder.rmdir()


def _set_aside(path: Path) -> None:
    """Rename a user's file that occupies the path of a product."""
    number = 1
    while os.path.lexists(aside := path.with_name(f"{path.name}.kept-{number}")):
        number += 1
    path.rename(aside)


def _is_intact(folder: Path, name: str, link: Link) -> bool:
    """Return whether an unmodified file of the program has this name; files behind a link do not count."""
    return not _is_behind_link(folder, name) and _matches(folder / name, link)


def _is_behind_link(folder: Path, name: str) -> bool:
    """Return whether a parent folder of a file is a link, which only a user creates."""
    return any((folder / parent).is_symlink() for parent in _parents(name))


def _parents(name: str) -> tuple[Path, ...]:
    """Return the parent folders of a file, the nearest first, without the run folder itself."""
    return tuple(Path(name).parents)[:-1]


def _same(path: Path, source: Path) -> bool:
    """Return whether two paths are the same file."""
    try:
        return os.path.samestat(path.lstat(), source.lstat())
    except OSError:
        return False


def _matches(path: Path, link: Link) -> bool:
    """Return whether a path is a file with the digest of a link."""
    try:
        return not path.is_symlink() and path.is_file() and file_digest(path) == link.digest
    except OSError:
        return False
