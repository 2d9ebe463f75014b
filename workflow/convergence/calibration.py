"""What stages really took over what was predicted, on this machine: by that, forecasts of any size are corrected.

Such stages are those of a convergence study of the case, or of former runs in the same folder.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import log
from pathlib import Path

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.convergence.measured import FILE, StageCost, read_accuracy, this_host
from reflowshock.workflow.store.store import Store


@dataclass(frozen=True, slots=True)
class Calibration:
    """Measured stages.

    Attributes:
        pairs: stage -> wall time [s] that was predicted and found, of each run.
        points: how many runs there are.
    """

    pairs: Mapping[str, tuple[tuple[float, float], ...]]
    points: int

    def knows(self, stage: str) -> bool:
        """Whether a stage was measured."""
        return bool(self.pairs.get(stage))

    def seconds(self, stage: str, predicted: float) -> float:
        """Correct a forecast [s] by the measured run whose forecast was nearest to it; one without stays."""
        if not self.knows(stage) or predicted <= 0.0:
            return predicted
        nearest = min(self.pairs[stage], key=lambda pair: abs(log(predicted / pair[0])))
        return predicted * nearest[1] / nearest[0]


def calibration(runs: Iterable[Mapping[str, StageCost]]) -> Calibration:
    """Take what the stages of runs cost and what was predicted of them."""
    every = [stages for stages in runs if stages]
    pairs: dict[str, list[tuple[float, float]]] = {}
    for stages in every:
        for stage, cost in stages.items():
            if cost.forecast is not None and cost.forecast > 0.0:
                pairs.setdefault(stage, []).append((cost.forecast, cost.seconds))
    return Calibration({stage: tuple(found) for stage, found in pairs.items()}, len(every))


def folder_name(case: Case) -> str:
    """Return the name of the folder in which the accuracy of a case is measured, if no other is given."""
    return f"{case.case.name}-accuracy"


def default_folder(case: Case) -> Path:
    """Return that folder, beside the run folders."""
    return Path("runs") / folder_name(case)


def calibration_of(case: Case) -> Calibration | None:
    """Return what was measured of a case on this machine; None where nothing was."""
    found = read_accuracy(default_folder(case) / FILE)
    if found is None or found.machine != this_host():
        return None
    return calibration(one.stages for one in found.measurements)


def calibration_in(store: Store, stages: Iterable[str]) -> Calibration:
    """Return what stages of former runs in a store took on this machine, those that were not broken off."""
    machine = str(this_host())
    return calibration(
        {stage: StageCost(record["seconds"], record["core_seconds"], record.get("forecast"))}
        for stage in stages
        for record in store.records(stage)
        if record.get("machine") == machine and not record.get("continued")
    )
