"""Store of products, each under a key of all its inputs; run folders link them under readable names."""

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from reflowshock.problem import Problem
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.stage import Stage
from reflowshock.workflow.store.keys import digest_of
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import RECORD, SEAL, content_digest, discard, read_record

HOME = ".store"  # in a run folder, or in the folder of a study
REPETITIONS = 2  # of a cheap point, so that machine load and first compilation do not count
CASE = "inputs/case.json"
CASE_CHANGED = "was changed since it was written; `reflowshock run` with the case file writes it again"
MESSAGE, TRACEBACK = "message.txt", "error.txt"  # in the partial folder of a failed stage


@dataclass(frozen=True, slots=True)
class Store:
    """Products of one run folder, or of all points of a study.

    ``.store/products/<stage>-<key>`` are the products. ``.store/work/<stage>-<key>`` is the run folder in which a
    product is being made; the complete product is moved atomically, and checkpoints of a killed stage stay there.

    Attributes:
        folder: Folder of the run, study or accuracy test.
        one_run: Whether the folder itself is the run folder; otherwise each point has its own, ``points/<key>``.
    """

    folder: Path
    one_run: bool = False

    @property
    def repeated(self) -> "list[Store]":
        """Stores of the runs that a convergence study repeats for timing."""
        return [Store(self.folder / f"again-{number}") for number in range(1, REPETITIONS + 1)]

    @property
    def home(self) -> Path:
        """Folder that contains the whole store."""
        return self.folder / HOME

    def product(self, point: Point, stage: str) -> Path:
        """Return the folder of a product, which may not exist yet."""
        return self.home / "products" / f"{stage}-{point.digests[stage]}"

    def work_folder(self, point: Point, stage: str) -> Path:
        """Return the temporary run folder in which a product is made."""
        return self.home / "work" / f"{stage}-{point.digests[stage]}"

    def run_folder(self, point: Point) -> Path:
        """Return the run folder of a point, which links its products."""
        return self.folder if self.one_run else self.folder / "points" / point.key

    def has(self, point: Point, stage: str) -> bool:
        """Return whether a product exists, without checking its files."""
        return (self.product(point, stage) / RECORD).is_file()

    def record(self, point: Point, stage: str) -> dict | None:
        """Return the record of a stage, or None if its product is missing or damaged."""
        return read_record(self.product(point, stage))

    def records(self, stage: str) -> Iterator[dict]:
        """Yield the records of all products of a stage, including products of earlier settings."""
        for product in sorted((self.home / "products").glob(f"{stage}-*")):
            record = read_record(product)
            if record is not None:
                yield record

    def is_complete(self, point: Point, until: str) -> bool:
        """Return whether the products of all stages up to one exist, without checking their files."""
        return all(self.has(point, stage.name) for stage in point.case.pipeline.upstream(until))

    def prepare_work(self, point: Point, stage: str) -> None:
        """Create the work folder of a product with links to the upstream products; delete the last error message."""
        folder = self.work_folder(point, stage)
        for path in (folder, self._message(point, stage).parent):
            if path.is_symlink() or path.is_file():
                path.unlink()
        folder.mkdir(parents=True, exist_ok=True)
        for before in point.case.pipeline.upstream(stage)[:-1]:
            link = folder / before.name
            discard(link)
            link.symlink_to(os.path.relpath(self.product(point, before.name), folder))
        write_case(folder, point.case)
        self._message(point, stage).unlink(missing_ok=True)

    def drop_work(self, point: Point, stage: str) -> None:
        """Remove the work folder of a product unless it contains partial files or checkpoints."""
        folder = self.work_folder(point, stage)
        if folder.is_dir() and not any((folder / f".{stage}.{kind}").exists() for kind in ("partial", "checkpoints")):
            discard(folder)

    def message(self, point: Point, stage: str) -> str | None:
        """Return the error message of the last attempt of a stage, or None if it did not fail or never ran."""
        path = self._message(point, stage)
        return path.read_text(encoding="utf-8") if path.is_file() else None

    def _message(self, point: Point, stage: str) -> Path:
        return self.work_folder(point, stage) / f".{stage}.partial" / MESSAGE


def reads(products: Mapping[str, Path], case: Case, stage: Stage) -> dict[str, str | None]:
    """Return digests of the upstream products that a stage reads, None for missing or damaged products.

    If a stage reads only the pad table of the geometry, the digest covers only this table.

    Args:
        products: Stage -> folder of its product.
        case: The case.
        stage: Stage that reads the products.

    Returns:
        Name of each stage that it reads, directly or indirectly -> digest of its product.
    """
    digests: dict[str, str | None] = {}
    for name in case.pipeline.read_by(stage.name):
        record = read_record(products[name])
        if record is None:
            digests[name] = None
        else:
            digests[name] = record["files"]["pads.json"] if stage.pads else content_digest(record)
    return digests


def read_case_table(folder: Path) -> dict:
    """Return the case of a run folder as a nested table in SI units, from the file in its store.

    Args:
        folder: Run folder.

    Raises:
        CaseError: the folder is not a run folder, or its case is damaged.
    """
    path = folder / CASE
    try:
        table: dict = json.loads(path.read_text(encoding="utf-8"))
        if table.pop(SEAL) != digest_of(table):
            raise ValueError(SEAL)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise CaseError(str(folder), [Problem("", "is not a run folder")]) from error
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise CaseError(str(path), [Problem("", CASE_CHANGED)]) from error
    return table


def write_case(folder: Path, case: Case) -> None:
    """Write the resolved case as JSON, with its digest, into a run folder unless the same file exists.

    Args:
        folder: Run folder.
        case: Resolved case, written in SI units.
    """
    path, content = folder / CASE, case.model_dump(mode="json")
    text = json.dumps(content | {SEAL: digest_of(content)}, indent=1) + "\n"
    if path.is_file() and path.read_bytes() == text.encode():
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)
