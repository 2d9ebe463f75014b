"""A store: every product of a stage once, under the key of all that it depends on; run folders show them by name."""

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.stage import Stage
from reflowshock.workflow.store.keys import digest_of
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import RECORD, SEAL, content_digest, discard, read_record

HOME = ".store"  # in a run folder, or in the folder of a study
AGAIN = 2  # times that a cheap point is run once more: load of the machine and first compilation are then not counted
CASE = "inputs/case.json"
MESSAGE, TRACEBACK = "message.txt", "error.txt"  # in the partial folder of a stage that failed: why


@dataclass(frozen=True, slots=True)
class Store:
    """The products of one run folder, or of all points of a study.

    ``.store/products/<stage>-<key>`` are the products. ``.store/work/<stage>-<key>`` is the run folder in which a
    product is being made: it becomes one at once and complete; checkpoints of a stage that was killed stay there.

    Attributes:
        folder: of the run, study or accuracy.
        one_run: whether the folder itself is the run folder; otherwise each point has its own, ``points/<key>``.
    """

    folder: Path
    one_run: bool = False

    @property
    def repeated(self) -> "list[Store]":
        """The stores of runs that a convergence study repeats for their times."""
        return [Store(self.folder / f"again-{number}") for number in range(1, AGAIN + 1)]

    @property
    def home(self) -> Path:
        """The folder that holds all of the store."""
        return self.folder / HOME

    def product(self, point: Point, stage: str) -> Path:
        """Return the folder of a product, which may not be there yet."""
        return self.home / "products" / f"{stage}-{point.digests[stage]}"

    def work_folder(self, point: Point, stage: str) -> Path:
        """Return the run folder in which a product is made."""
        return self.home / "work" / f"{stage}-{point.digests[stage]}"

    def run_folder(self, point: Point) -> Path:
        """Return the run folder of a point, which shows its products."""
        return self.folder if self.one_run else self.folder / "points" / point.key

    def has(self, point: Point, stage: str) -> bool:
        """Whether a product is there; its files are not looked at."""
        return (self.product(point, stage) / RECORD).is_file()

    def record(self, point: Point, stage: str) -> dict | None:
        """Return what a stage said of itself; None where its product is missing or its record is damaged."""
        return read_record(self.product(point, stage))

    def records(self, stage: str) -> Iterator[dict]:
        """Yield what every product of a stage says of itself, those of earlier settings too."""
        for product in sorted((self.home / "products").glob(f"{stage}-*")):
            record = read_record(product)
            if record is not None:
                yield record

    def is_complete(self, point: Point, until: str) -> bool:
        """Whether the products of all stages up to one are there; their files are not looked at."""
        return all(self.has(point, stage.name) for stage in point.case.pipeline.upstream(until))

    def prepare_work(self, point: Point, stage: str) -> None:
        """Make the run folder in which a product will be made, with links to those of the stages before it.

        Why it failed when it was last tried is forgotten.
        """
        folder = self.work_folder(point, stage)
        for place in (folder, self._message(point, stage).parent):
            if place.is_symlink() or place.is_file():
                place.unlink()
        folder.mkdir(parents=True, exist_ok=True)
        for before in point.case.pipeline.upstream(stage)[:-1]:
            link = folder / before.name
            discard(link)
            link.symlink_to(os.path.relpath(self.product(point, before.name), folder))
        write_case(folder, point.case)
        self._message(point, stage).unlink(missing_ok=True)

    def drop_work(self, point: Point, stage: str) -> None:
        """Remove the run folder in which a product was to be made, if its stage has left nothing in it."""
        folder = self.work_folder(point, stage)
        if folder.is_dir() and not any((folder / f".{stage}.{kind}").exists() for kind in ("partial", "checkpoints")):
            discard(folder)

    def message(self, point: Point, stage: str) -> str | None:
        """Return why a stage failed when it was last tried; None where it did not, or was not tried."""
        path = self._message(point, stage)
        return path.read_text(encoding="utf-8") if path.is_file() else None

    def _message(self, point: Point, stage: str) -> Path:
        return self.work_folder(point, stage) / f".{stage}.partial" / MESSAGE


def reads(products: Mapping[str, Path], case: Case, stage: Stage) -> dict[str, str | None]:
    """Return digests of all that a stage reads, None of a product that is missing or whose record is damaged.

    These are the products of the stages that it follows, and that those follow; of the geometry only the pad table,
    for a stage that reads no more of it.

    Args:
        products: stage -> folder of its product.
        case: the case.
        stage: that reads them.
    """
    found: dict[str, str | None] = {}
    for name in case.pipeline.read_by(stage.name):
        record = read_record(products[name])
        if record is None:
            found[name] = None
        else:
            found[name] = record["files"]["pads.json"] if stage.pads else content_digest(record)
    return found


def write_case(folder: Path, case: Case) -> None:
    """Write the resolved case into a run folder, if it is not there."""
    path, content = folder / CASE, case.model_dump(mode="json")
    text = json.dumps(content | {SEAL: digest_of(content)}, indent=1) + "\n"
    if path.is_file() and path.read_bytes() == text.encode():
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)
