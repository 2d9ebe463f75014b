"""Runs of a convergence study: compute missing ones, repeat cheap ones for their times, compare the results."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

from reflowshock.workflow.convergence.accuracy_file import Measurement, StageCost
from reflowshock.workflow.convergence.calibration import calibration_from_runs
from reflowshock.workflow.convergence.convergence_study import ConvergenceStudy, Quantity, StudyRun
from reflowshock.workflow.convergence.errors import Error, compute_errors
from reflowshock.workflow.kinds import stage_seconds
from reflowshock.workflow.pipeline.points import read_possible_points
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import Store

CHEAP = 8.0  # largest cost of a run that is repeated [core-seconds]
COARSEST = 4  # coarsest runs of each parameter, which are computed regardless of their time
SECONDS_TO_SCHEDULE = 4.0  # time until the first stage of a batch starts

Compute = Callable[[Store, Sequence[Point]], Mapping[str, str]]


@dataclass(slots=True)
class StudyRunner:
    """Runner of a convergence study: computes its points and returns measurements.

    Attributes:
        study: Convergence study.
        case: Case file.
        settings: Dotted key -> value for all runs.
        folder: Folder of the store.
        compute: Function that computes points in a store up to the study's last stage and returns key -> message of
            each failed point.
        budget: Wall time for all runs [s]; infinite without a limit.
        longest: Largest predicted wall time of a run [s]; the coarsest runs of each parameter are exempt.
        oversubscribe: Whether MPI may have more ranks than cores.
        force: Whether implausible values are accepted.
        failed: Key of a point -> message of its failure, also from earlier calls.
        points: Name of run -> its point.
        impossible: Name of run -> problem with its settings.
        left_out: Name of run -> predicted wall time that exceeded the limit [s].
    """

    study: ConvergenceStudy
    case: Path
    settings: Mapping[str, str]
    folder: Path
    compute: Compute
    budget: float = float("inf")
    longest: float = float("inf")
    oversubscribe: bool = False
    force: bool = False
    failed: dict[str, str] = field(default_factory=dict)
    points: dict[str, Point] = field(default_factory=dict)
    impossible: dict[str, str] = field(default_factory=dict)
    left_out: dict[str, float] = field(default_factory=dict)
    _start: float = field(default_factory=perf_counter)
    _forecasts: dict[str, dict[str, float]] = field(default_factory=dict)

    @property
    def remaining(self) -> float:
        """Remaining wall time of the budget [s]."""
        return self.budget - (perf_counter() - self._start)

    @property
    def stores(self) -> list[Store]:
        """The store of the results, followed by the stores of repeated runs, which count for their times only."""
        store = Store(self.folder)
        return [store, *store.repeated]

    def compute_runs(self, runs: Sequence[StudyRun]) -> None:
        """Compute the missing points of runs, the cheapest first; then repeat cheap ones.

        Runs of the first parameter precede all others, since they may be the reference.
        """
        self._read(runs)
        main, possible = self.study.parameters[0].name, [run for run in runs if run.name in self.points]
        ordered = sorted(possible, key=lambda run: (run.parameter != main, self.predicted(run)))
        for batch in [ordered] if self.budget == float("inf") else [[run] for run in ordered]:
            self._run(self.stores[0], batch)
        for store in self.stores[1:]:
            repeated = [run for run in ordered if self._is_complete(run) and self._needs_repetition(run)]
            self._run(store, repeated)

    def measurements(self, runs: Sequence[StudyRun]) -> dict[str, Measurement]:
        """Return name of run -> measurement, for all runs that were computed or failed."""
        complete = [run for run in runs if run.name in self.points and self._is_complete(run)]
        results = {run.name: self._quantities(run) for run in complete}
        main = self.study.parameters[0]
        errors = compute_errors(results, runs, main.runs, main.order)
        measurements = {run.name: self._measurement(run, errors.get(run.name, {})) for run in runs}
        return {name: m for name, m in measurements.items() if m.stages or m.failed}

    def predicted(self, run: StudyRun, store: Store | None = None) -> float:
        """Return the predicted wall time of a run [s]: forecasts of missing stages, corrected by measured times.

        Args:
            run: Run of the study.
            store: Store that may have some of the stages; None for the store of the results.
        """
        point, store = self.points[run.name], store or self.stores[0]
        calibration = calibration_from_runs(self._costs(self.points[name]) for name in self._complete_runs())
        seconds = self._forecast(point)
        stages = [stage.name for stage in point.case.pipeline.upstream(self.study.until)]
        return sum(
            calibration.corrected(name, seconds[name])
            for name in stages
            if name in seconds and not store.has(point, name)
        )

    def _complete_runs(self) -> list[str]:
        return [name for name, point in self.points.items() if self.stores[0].is_complete(point, self.study.until)]

    def _forecast(self, point: Point) -> dict[str, float]:
        if point.key not in self._forecasts:
            self._forecasts[point.key] = stage_seconds(point.case)
        return self._forecasts[point.key]

    def _read(self, runs: Sequence[StudyRun]) -> None:
        """Read the cases of runs; record impossible ones, and those that failed in an earlier call."""
        for run in runs:
            points, errors = read_possible_points(
                self.case, [dict(self.settings) | dict(run.settings)], self.oversubscribe, self.force
            )
            if errors:
                self.impossible[run.name] = "; ".join(str(problem) for problem in errors[0].problems)
            else:
                self.points[run.name] = points[0]
                self.failed |= _failed_before(self.stores[0], points[0], self.study.until)

    def _run(self, store: Store, runs: Sequence[StudyRun]) -> None:
        """Compute missing points that fit into the budget."""
        until, missing = self.study.until, []
        for run in runs:
            point = self.points[run.name]
            if store.is_complete(point, until) or point.key in self.failed:
                continue
            expected = self.predicted(run, store) + SECONDS_TO_SCHEDULE
            if expected <= self.remaining and (expected <= self.longest or self._is_required(run)):
                missing.append(point)
            elif store == self.stores[0]:
                self.left_out[run.name] = expected
        if missing:
            self.failed |= self.compute(store, missing)

    def _is_required(self, run: StudyRun) -> bool:
        """Return whether a run is computed regardless of its time: a coarse or a recommended one."""
        coarse = {run.name for parameter in self.study.parameters for run in parameter.runs[:COARSEST]}
        return run.name in coarse or all(run.name != other.name for other in self.study.runs)

    def _is_complete(self, run: StudyRun) -> bool:
        return self.stores[0].is_complete(self.points[run.name], self.study.until)

    def _needs_repetition(self, run: StudyRun) -> bool:
        """Return whether a run is cheap, by measurement or forecast, or was continued with an incomplete time."""
        point, store = self.points[run.name], self.stores[0]
        stages = [stage.name for stage in point.case.pipeline.upstream(self.study.until)]
        records = [record for stage in stages if (record := store.record(point, stage)) is not None]
        measured = sum(record["core_seconds"] for record in records)
        predicted = sum(seconds for stage, seconds in self._forecast(point).items() if stage in stages)
        return min(measured, predicted or measured) < CHEAP or any(record["continued"] for record in records)

    def _quantities(self, run: StudyRun) -> Mapping[str, Quantity]:
        point = self.points[run.name]
        return self.study.measure(point.case, self.stores[0].run_folder(point))

    def _measurement(self, run: StudyRun, errors: Mapping[str, Error]) -> Measurement:
        """Return the measurement of a run; without costs and failure if it was not run."""
        point = self.points.get(run.name)
        costs = self._costs(point) if point is not None and self._is_complete(run) else {}
        message = self.impossible.get(run.name, "") if point is None else self.failed.get(point.key, "")
        key = "" if point is None else point.key
        failed = "" if costs else message
        return Measurement(
            run.name, run.parameter, run.value, run.settings, key, costs, errors, failed, against=run.against
        )

    def _costs(self, point: Point) -> dict[str, StageCost]:
        """Return the smallest times of the timed stages over all uninterrupted runs."""
        predicted, costs = self._forecast(point), {}
        for stage in self.study.timed:
            records = [record for store in self.stores if (record := store.record(point, stage)) is not None]
            uninterrupted = [record for record in records if not record["continued"]] or records
            times = {name: min(record[name] for record in uninterrupted) for name in ("seconds", "core_seconds")}
            costs[stage] = StageCost(**times, forecast=predicted.get(stage))
        return costs


def _failed_before(store: Store, point: Point, until: str) -> dict[str, str]:
    """Return the key and message of a point with a failed stage; empty if no stage failed."""
    missing = [stage.name for stage in point.case.pipeline.upstream(until) if not store.has(point, stage.name)]
    messages = [f"stage {stage}: {text}" for stage in missing if (text := store.message(point, stage)) is not None]
    return {point.key: messages[0]} if messages else {}
