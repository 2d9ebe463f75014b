"""The runs of a convergence study: computed where they are missing, timed, compared; cheap ones several times."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

from reflowshock.workflow.convergence.calibration import calibration
from reflowshock.workflow.convergence.errors import Error, errors_of
from reflowshock.workflow.convergence.measured import Measurement, StageCost
from reflowshock.workflow.convergence.series import ConvergenceStudy, Quantity, StudyRun
from reflowshock.workflow.kinds import stage_seconds
from reflowshock.workflow.pipeline.points import read_possible_points
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import Store

CHEAP = 8.0  # up to these core-seconds [s]
LEAST = 4  # coarsest runs of a parameter that are run, however long they take
SECONDS_TO_SCHEDULE = 4.0  # of a call that computes points, until the first stage runs

Compute = Callable[[Store, Sequence[Point]], Mapping[str, str]]


@dataclass(slots=True)
class StudyRunner:
    """Computes the points of a convergence study, and says what is known of them.

    Attributes:
        study: its runs.
        case: the case file.
        settings: dotted key -> value that hold for all runs.
        folder: of the store.
        compute: computes points in a store up to the study's last stage; returns the key of each that failed and why.
        budget: wall time that may be spent [s]; infinite without a limit.
        longest: that a run of the study may be predicted to take [s], but for the coarsest ones of the parameters.
        oversubscribe: whether MPI may have more ranks than cores.
        force: whether values that are not plausible are welcome.
        failed: key of a point -> why it failed, also of earlier calls.
        points: name of run -> its point.
        impossible: name of run -> what is wrong with its settings.
        left_out: name of run -> wall time [s] that was predicted and did not fit.
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
    def left(self) -> float:
        """Wall time that is left of the budget [s]."""
        return self.budget - (perf_counter() - self._start)

    @property
    def stores(self) -> list[Store]:
        """The store, and those of runs that are only for their times."""
        store = Store(self.folder)
        return [store, *store.repeated]

    def compute_runs(self, runs: Sequence[StudyRun]) -> None:
        """Compute the points of runs that are missing, the cheapest first; then cheap ones again.

        Those of the first parameter go before all others, which may have to be compared with them.
        """
        self._read(runs)
        main, known = self.study.parameters[0].name, [run for run in runs if run.name in self.points]
        ready = sorted(known, key=lambda run: (run.parameter != main, self.predicted(run)))
        for batch in [ready] if self.budget == float("inf") else [[run] for run in ready]:
            self._run(self.stores[0], batch)
        for store in self.stores[1:]:
            again = [run for run in ready if self._is_done(run) and self._wants_repetition(run)]
            self._run(store, again)

    def measured(self, runs: Sequence[StudyRun]) -> dict[str, Measurement]:
        """Return what is known of runs: their costs, their errors against each other; failures."""
        done = [run for run in runs if run.name in self.points and self._is_done(run)]
        answers = {run.name: self._answers(run) for run in done}
        main = self.study.parameters[0]
        errors = errors_of(answers, runs, main.runs, main.order)
        found = {run.name: self._measurement(run, errors.get(run.name, {})) for run in runs}
        return {name: one for name, one in found.items() if one.stages or one.failed}

    def predicted(self, run: StudyRun, store: Store | None = None) -> float:
        """Wall time of the stages of a run that a store does not have [s]: the forecast, corrected by measurements."""
        point, store = self.points[run.name], store or self.stores[0]
        known, seconds = calibration(self._costs(self.points[one]) for one in self._known()), self._forecast(point)
        stages = [stage.name for stage in point.case.pipeline.upstream(self.study.until)]
        return sum(
            known.seconds(name, seconds[name]) for name in stages if name in seconds and not store.has(point, name)
        )

    def _known(self) -> list[str]:
        return [name for name, point in self.points.items() if self.stores[0].is_complete(point, self.study.until)]

    def _forecast(self, point: Point) -> dict[str, float]:
        if point.key not in self._forecasts:
            self._forecasts[point.key] = stage_seconds(point.case)
        return self._forecasts[point.key]

    def _read(self, runs: Sequence[StudyRun]) -> None:
        """Read the cases of runs; one that cannot be is noted, and one that failed before, as it would again."""
        for run in runs:
            points, wrong = read_possible_points(
                self.case, [dict(self.settings) | dict(run.settings)], self.oversubscribe, self.force
            )
            if wrong:
                self.impossible[run.name] = "; ".join(str(problem) for problem in wrong[0].problems)
            else:
                self.points[run.name] = points[0]
                self.failed |= _failed_before(self.stores[0], points[0], self.study.until)

    def _run(self, store: Store, runs: Sequence[StudyRun]) -> None:
        """Compute what is missing and fits into the budget."""
        until, wanted = self.study.until, []
        for run in runs:
            point = self.points[run.name]
            if store.is_complete(point, until) or point.key in self.failed:
                continue
            expected = self.predicted(run, store) + SECONDS_TO_SCHEDULE
            if expected <= self.left and (expected <= self.longest or self._is_wanted(run)):
                wanted.append(point)
            elif store == self.stores[0]:
                self.left_out[run.name] = expected
        if wanted:
            self.failed |= self.compute(store, wanted)

    def _is_wanted(self, run: StudyRun) -> bool:
        """Whether a run is run however long it takes: one of the coarsest of a parameter, or chosen off the study."""
        coarsest = {one.name for parameter in self.study.parameters for one in parameter.runs[:LEAST]}
        return run.name in coarsest or all(run.name != one.name for one in self.study.runs)

    def _is_done(self, run: StudyRun) -> bool:
        return self.stores[0].is_complete(self.points[run.name], self.study.until)

    def _wants_repetition(self, run: StudyRun) -> bool:
        """Whether a point is cheap, by measurement or forecast, or its time is not that of the whole run."""
        point, store = self.points[run.name], self.stores[0]
        stages = [stage.name for stage in point.case.pipeline.upstream(self.study.until)]
        records = [record for stage in stages if (record := store.record(point, stage)) is not None]
        taken = sum(record["core_seconds"] for record in records)
        predicted = sum(seconds for stage, seconds in self._forecast(point).items() if stage in stages)
        return min(taken, predicted or taken) < CHEAP or any(record["continued"] for record in records)

    def _answers(self, run: StudyRun) -> Mapping[str, Quantity]:
        point = self.points[run.name]
        return self.study.measure(point.case, self.stores[0].run_folder(point))

    def _measurement(self, run: StudyRun, errors: Mapping[str, Error]) -> Measurement:
        """Return what is known of a run; neither costs nor a failure where it was not run."""
        point = self.points.get(run.name)
        costs = self._costs(point) if point is not None and self._is_done(run) else {}
        why = self.impossible.get(run.name, "") if point is None else self.failed.get(point.key, "")
        key = "" if point is None else point.key
        failed = "" if costs else why
        return Measurement(
            run.name, run.parameter, run.value, run.settings, key, costs, errors, failed, against=run.against
        )

    def _costs(self, point: Point) -> dict[str, StageCost]:
        """Return the smallest times of the stages that count, of all runs that were not broken off."""
        predicted, costs = self._forecast(point), {}
        for stage in self.study.timed:
            records = [record for store in self.stores if (record := store.record(point, stage)) is not None]
            whole = [record for record in records if not record["continued"]] or records
            times = {name: min(record[name] for record in whole) for name in ("seconds", "core_seconds")}
            costs[stage] = StageCost(**times, forecast=predicted.get(stage))
        return costs


def _failed_before(store: Store, point: Point, until: str) -> dict[str, str]:
    """Return key and message of a point of which a stage was tried and failed."""
    missing = [stage.name for stage in point.case.pipeline.upstream(until) if not store.has(point, stage.name)]
    found = [f"stage {stage}: {said}" for stage in missing if (said := store.message(point, stage)) is not None]
    return {point.key: found[0]} if found else {}
