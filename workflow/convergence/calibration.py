"""Correction of cost forecasts by the measured times of earlier runs on this machine.

Earlier runs are found in the convergence study of the case and in the same run folder.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import log
from pathlib import Path

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.convergence.accuracy_file import FILE, StageCost, read_accuracy, this_host
from reflowshock.workflow.store.store import Store


@dataclass(frozen=True, slots=True)
class Calibration:
    """Predicted and measured times of earlier runs.

    Attributes:
        pairs: Stage -> predicted and measured wall time of each run [s].
        points: Number of runs.
    """

    pairs: Mapping[str, tuple[tuple[float, float], ...]]
    points: int

    def covers(self, stage: str) -> bool:
        """Return whether a stage was measured."""
        return bool(self.pairs.get(stage))

    def corrected(self, stage: str, predicted: float) -> float:
        """Return a predicted wall time [s], scaled as the measured run with the nearest prediction, if there is one."""
        if not self.covers(stage) or predicted <= 0.0:
            return predicted
        nearest = min(self.pairs[stage], key=lambda pair: abs(log(predicted / pair[0])))
        return predicted * nearest[1] / nearest[0]


def calibration_from_runs(runs: Iterable[Mapping[str, StageCost]]) -> Calibration:
    """Return the pairs of predicted and measured wall times that correct further predictions.

    Args:
        runs: Stage -> measured and predicted cost, for each run; empty for a failed run.
    """
    completed = [stages for stages in runs if stages]
    pairs: dict[str, list[tuple[float, float]]] = {}
    for stages in completed:
        for stage, cost in stages.items():
            if cost.forecast is not None and cost.forecast > 0.0:
                pairs.setdefault(stage, []).append((cost.forecast, cost.seconds))
    return Calibration({stage: tuple(times) for stage, times in pairs.items()}, len(completed))


def folder_name(case: Case) -> str:
    """Return the default name of the folder for the convergence study of a case."""
    return f"{case.case.name}-accuracy"


def default_folder(case: Case) -> Path:
    """Return the default folder for the convergence study of a case, next to its run folders."""
    return Path("runs") / folder_name(case)


def calibration_from_study(case: Case) -> Calibration | None:
    """Return the corrections of predicted times by the study of a case; None if it was not run on this machine.

    Returns:
        Pairs of predicted and measured wall time [s] of each stage, from the study in the default folder.
    """
    accuracy = read_accuracy(default_folder(case) / FILE)
    if accuracy is None or accuracy.machine != this_host():
        return None
    return calibration_from_runs(measurement.stages for measurement in accuracy.measurements)


def calibration_from_store(store: Store, stages: Iterable[str]) -> Calibration:
    """Return the corrections of predicted times by earlier uninterrupted stages in a store on this machine.

    Args:
        store: Store whose records are read.
        stages: Names of the stages.
    """
    machine = str(this_host())
    return calibration_from_runs(
        {stage: StageCost(record["seconds"], record["core_seconds"], record.get("forecast"))}
        for stage in stages
        for record in store.records(stage)
        if record.get("machine") == machine and not record.get("continued")
    )
