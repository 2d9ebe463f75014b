"""Python interface: load, plan and run a case; open a run folder and read its results."""

import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rich.console import Console

from reflowshock.names import find_nearest
from reflowshock.notebook import Metrics, ReportView, case_html, plan_html, run_html
from reflowshock.problem import as_toml
from reflowshock.workflow import plan
from reflowshock.workflow.case.case import Case as ResolvedCase
from reflowshock.workflow.case.fields import display_values
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.kinds import kind_of
from reflowshock.workflow.pipeline.points import read_case_of_run
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.plan import PlannedStage
from reflowshock.workflow.process.kernel_folder import compilation_time
from reflowshock.workflow.process.products import read_json
from reflowshock.workflow.store.folders import read_mark
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import Store

if TYPE_CHECKING:
    import numpy as np
    import pandas
    import pyvista

__all__ = ["Case", "CaseError", "Metric", "Plan", "PlannedStage", "Run", "RunFailed", "UnknownName"]

WIDTH = 120  # line width of a plan as text


class UnknownName(LookupError):
    """Unknown name of a joint, mode or folder; the message contains the nearest valid name."""


class RunFailed(RuntimeError):
    """Failed run; the message is the error message of the command."""


class Metric(NamedTuple):
    """Value with its SI unit."""

    value: float | str
    unit: str


@dataclass(frozen=True, slots=True)
class Plan:
    """Plan of a run; its text is the output of ``reflowshock plan``.

    Attributes:
        stages: Planned actions by stage, in order.
        effects: Decisions by effect: "on", "why" and, if predicted, "influence" on the results.
        text: Plan as text.
        compilation: Predicted wall time for compiling kernels in a first run [s].
    """

    stages: Mapping[str, PlannedStage]
    effects: Mapping[str, Mapping[str, Any]]
    text: str
    compilation: float

    @property
    def seconds(self) -> float:
        """Predicted wall time of the stages that would run [s]."""
        return self.compilation + sum(stage.seconds or 0.0 for stage in self.stages.values() if stage.runs)

    def __str__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        return plan_html(self.stages, self.effects, self.seconds)


@dataclass(frozen=True, slots=True)
class Case:
    """Checked case file with settings.

    Attributes:
        path: Path of the case file.
        settings: "dotted.key=value" settings that override the file.
        resolved: Case with every value in SI units.
    """

    path: Path
    settings: tuple[str, ...]
    resolved: ResolvedCase

    @classmethod
    def load(cls, path: str | Path, overrides: Mapping[str, object] | Sequence[str] = ()) -> "Case":
        """Read and check a case file.

        Args:
            path: TOML file.
            overrides: Values with units by dotted key, e.g. ``{"shock.duration": "2 ms"}``, or "dotted.key=value".

        Raises:
            CaseError: With all problems, their positions in the file, allowed values and nearest valid names.
        """
        pairs = overrides.items() if isinstance(overrides, Mapping) else ()
        settings = tuple(f"{key}={_toml(value)}" for key, value in pairs) or tuple(overrides)
        return cls(Path(path), settings, read_case(Path(path), settings, True))

    @property
    def name(self) -> str:
        """Name of the case."""
        return self.resolved.case.name

    def plan(self, out: str | Path | None = None) -> Plan:
        """Return the plan of a run in a folder without running or writing anything."""
        store, point = self._store(out), Point({}, self.resolved)
        text = StringIO()
        plan.show_plan(store, point, Console(file=text, width=WIDTH, force_jupyter=False))
        stages, effects = plan.planned_stages(store, point), kind_of(self.resolved).forecast(self.resolved).effects
        once = compilation_time([name for name, stage in stages.items() if stage.runs])
        return Plan(stages, effects, text.getvalue(), once)

    def run(
        self, out: str | Path | None = None, *, until: str = "report", cores: int | None = None, force: bool = False
    ) -> "Run":
        """Run all missing, stale and damaged stages in a subprocess, like ``reflowshock run``.

        Args:
            out: Run folder; None for ``runs/<name of the case>``.
            until: Last stage to run.
            cores: Number of cores; None for all.
            force: Whether to accept a folder with another case, and implausible values.

        Returns:
            The run, even if a health check failed: see ``Run.is_healthy``.

        Raises:
            RunFailed: A stage failed, or the command could not start.
        """
        store = self._store(out)
        options = ["--out", str(store.folder), "--until", until, "--yes"]
        options += [part for setting in self.settings for part in ("--set", setting)]
        options += [] if cores is None else ["--cores", str(cores)]
        options += ["--force"] if force else []
        command = [sys.executable, "-m", "reflowshock", "run", str(self.path), *options]
        done = subprocess.run(command, stderr=subprocess.PIPE, text=True, encoding="utf-8", check=False)
        if done.returncode and not store.is_complete(Point({}, self.resolved), until):
            raise RunFailed(done.stderr.strip() or f"the command ended with exit code {done.returncode}")
        return Run.open(store.folder)

    def _repr_html_(self) -> str:
        return case_html(self.name, self.resolved.case.title, display_values(self.resolved))

    def _store(self, out: str | Path | None) -> Store:
        return Store(Path(out) if out is not None else Path("runs") / self.resolved.run_name, one_run=True)


@dataclass(frozen=True)
class Run:
    """Results in a run folder.

    Attributes:
        folder: Run folder.
        case: Case of the run with every value in SI units.
    """

    folder: Path
    case: ResolvedCase

    @classmethod
    def open(cls, folder: str | Path) -> "Run":
        """Open a run folder.

        Raises:
            UnknownName: The folder is not a run folder; the message contains the nearest run folder.
            CaseError: The folder has no case, or its case is damaged.
        """
        folder = Path(folder)
        mark = read_mark(folder)
        if mark is None or mark["holds"] != "run":
            siblings = folder.parent.iterdir() if folder.parent.is_dir() else ()
            names = [path.name for path in siblings if (read_mark(path) or {}).get("holds") == "run"]
            raise UnknownName(f"{folder} is not a run folder{_hint(folder.name, names)}")
        return cls(folder, read_case_of_run(folder))

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Content of ``summary.json``."""
        return read_json(self._product("summary.json"))

    @property
    def metrics(self) -> Metrics:
        """Results by name, each a ``Metric`` with its unit."""
        records = self.summary["metrics"].items()
        return Metrics({name: Metric(record["value"], record["unit"]) for name, record in records})

    @property
    def report(self) -> ReportView:
        """Report with tables, charts and 3D view, which notebooks display."""
        return ReportView(self._product("report.html"))

    @property
    def is_healthy(self) -> bool:
        """Whether all health checks passed."""
        return all(check["ok"] for check in self.summary["health"].values())

    @cached_property
    def joints(self) -> "pandas.DataFrame":
        """Table with one row per joint: position, shape, reflow verdict, errors, mesh; SI units, angles in degrees."""
        import pandas

        from reflowshock.workflow.package_report.joint_records import joint_records

        if not (self.folder / "reflow/joints.json").exists():
            raise UnknownName(
                f"{self.folder} has no joints: it is a case of kind {self.case.kind!r}, or not yet reflowed"
            )
        records = joint_records(self.folder)
        flat = [{key: value for key, value in record.items() if _is_scalar(value)} for record in records]
        return pandas.DataFrame(flat).set_index("name")

    @cached_property
    def history(self) -> dict[str, dict[str, "np.ndarray"]]:
        """Histories by mode (or solver) of the shock: arrays in SI units by name, including "time" [s]."""
        import numpy as np

        result = {}
        for path in sorted(self.folder.glob("shock/*/history.npz")):
            with np.load(path) as arrays:
                result[path.parent.name] = dict(arrays)
        return result

    def surface(self, joint: str) -> "pyvista.PolyData":
        """Return the closed surface of a joint in its own frame [m]; cell data "boundary": 0 free, 1 board, 2 package.

        Raises:
            UnknownName: No surface of this joint exists; the message contains the nearest name.
        """
        path = self.folder / "surface" / f"{joint}.vtu"
        names = sorted(file.stem for file in path.parent.glob("*.vtu"))
        if joint not in names:
            raise UnknownName(f"{self.folder} has no surface of a joint {joint!r}{_hint(joint, names)}")
        import pyvista

        from reflowshock.meshing.surface.closed_surface import read_surface

        closed = read_surface(path)
        surface = pyvista.PolyData.from_regular_faces(closed.points, closed.triangles)
        surface.cell_data["boundary"] = closed.boundary
        return surface

    def _repr_html_(self) -> str:
        picture = self.folder / "geometry/preview.png"
        content = picture.read_bytes() if picture.exists() else None
        return run_html(self.summary, self.case.case.title, content)

    def _product(self, name: str) -> Path:
        path = self.folder / name
        if not path.exists():
            raise UnknownName(f"{path} does not exist: the run is not complete")
        return path


def _hint(name: str, names: Sequence[str]) -> str:
    """Return a hint with the nearest name, or an empty string without names."""
    return f"; did you mean {find_nearest(name, names) or names[0]}?" if names else ""


def _is_scalar(value: object) -> bool:
    return value is None or isinstance(value, bool | int | float | str)


def _toml(value: object) -> str:
    """Return a value as text for the option ``--set``."""
    return value if isinstance(value, str) else as_toml(value)
