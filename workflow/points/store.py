"""A store: every stage's product once, under the digest of all that it depends on; a run folder for each point."""

import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from workflow.case_kind import Case
from workflow.inputs import write_inputs
from workflow.points.point import Point, digests
from workflow.stage_runner import MESSAGE


@dataclass(frozen=True, slots=True)
class Store:
    """A folder with the products of points.

    ``stages/<stage>-<digest>`` are the products. ``points/<key>`` is a run folder as any other, whose stages are links
    to them; the last stage, the report, is in it. ``work/<stage>-<digest>`` is the run folder in which a product is
    being made: it becomes one at once and complete; checkpoints of a stage that was killed stay there.
    """

    folder: Path

    def stage_folder(self, case: Case, stage: str) -> Path:
        """Return the folder of a stage's product, which may not be there yet."""
        return self._product(case, digests(case), stage)

    def run_folder(self, point: Point) -> Path:
        """Return the run folder of a point."""
        return self.folder / "points" / point.key

    def has(self, point: Point, stage: str) -> bool:
        """Whether the product of a point's stage is there and complete."""
        return (self._product(point.case, point.digests, stage) / "stage.json").is_file()

    def is_complete(self, point: Point, until: str) -> bool:
        """Whether the products of all stages up to one are there."""
        return all(self.has(point, stage.name) for stage in point.case.pipeline.upstream(until))

    def work_folder(self, point: Point, stage: str) -> Path:
        """Return the run folder in which a stage's product is made."""
        if stage == point.case.pipeline.names[-1]:
            return self.run_folder(point)
        return self.folder / "work" / f"{stage}-{point.digests[stage]}"

    def prepare(self, point: Point) -> None:
        """Make the run folder of a point: its inputs, and links to its products, also to those not there yet."""
        self._prepare(self.run_folder(point), point, point.case.pipeline.names[-1])

    def prepare_work(self, point: Point, stage: str) -> None:
        """Make the run folder in which a stage's product will be made, with links to those of the stages before it.

        Why it failed when it was last tried is forgotten.
        """
        self._prepare(self.work_folder(point, stage), point, stage)
        self._message(point, stage).unlink(missing_ok=True)

    def message(self, point: Point, stage: str) -> str | None:
        """Return why a stage failed when it was last tried; None where it did not, or was not tried."""
        path = self._message(point, stage)
        return path.read_text(encoding="utf-8") if path.is_file() else None

    def _message(self, point: Point, stage: str) -> Path:
        return self.work_folder(point, stage) / f".{stage}.partial" / MESSAGE

    def _prepare(self, folder: Path, point: Point, last: str) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        for stage in point.case.pipeline.upstream(last)[:-1]:
            link = folder / stage.name
            if not link.is_symlink():
                product = self._product(point.case, point.digests, stage.name)
                link.symlink_to(os.path.relpath(product.resolve(), folder.resolve()))
        write_inputs(folder, point.case)

    def _product(self, case: Case, found: Mapping[str, str], stage: str) -> Path:
        if stage == case.pipeline.names[-1]:
            return self.folder / "points" / found[stage] / stage
        return self.folder / "stages" / f"{stage}-{found[stage]}"


def publish(work: Path, stage: str, product: Path) -> None:
    """Move what a stage has made out of its work folder, at once, and remove that folder."""
    if product.exists():
        shutil.rmtree(product)
    product.parent.mkdir(parents=True, exist_ok=True)
    (work / stage).rename(product)
    shutil.rmtree(work)
