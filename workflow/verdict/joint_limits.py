"""Criteria of joints: the user's limits of stress and plastic work, and the user's law of drop life."""

from dataclasses import dataclass

import numpy as np

from reflowshock.fem.output.ranking import PEEL, PLASTIC_WORK, VON_MISES, Arrays, Measure
from reflowshock.fem.problem.failure import Life
from reflowshock.workflow.case.text import SHOWN
from reflowshock.workflow.verdict.criterion import Criterion, JudgedDrop, Judgement, worst

MEASURES: dict[str, Measure] = {"peel_stress": PEEL, "layer_von_mises": VON_MISES, "layer_plastic_work": PLASTIC_WORK}


@dataclass(frozen=True)
class JointLimit(Criterion):
    """Limit of a measure of each joint, at its worse pad; the joint with the smallest margin decides."""

    name: str
    words: str
    formula: str = "peak <= limit"
    valid: str = "the joints and the process of the user's tests"

    @property
    def measure(self) -> Measure:
        """Judged measure."""
        return MEASURES[self.name]

    def judge(self, drop: JudgedDrop) -> Judgement:
        """Judge the joint with the smallest margin."""
        why = f"needs shock.failure.{self.name}.limit"
        return worst(self.judge_joints(drop)) or Judgement(self.name, unit=self.measure.unit, why=why)

    def judge_joints(self, drop: JudgedDrop) -> list[Judgement]:
        """Return the judgement on each joint in the order of the history; empty without a limit."""
        limit = getattr(drop.failure, self.name)
        if limit is None:
            return []
        peaks = zip(drop.history["joints"], self.measure.peaks(drop.history), strict=True)
        return [
            Judgement(self.name, limit.source, float(peak), limit.limit, self.measure.unit, joint=str(joint))
            for joint, peak in peaks
        ]


class DropLife(Criterion):
    """Drops to failure by the user's law of life, at the lower end of its scatter, against the required drops."""

    name = "life"
    words = "life"
    formula = "C s^-m / scatter >= required drops"
    valid = "loads of the user's tests"

    def judge(self, drop: JudgedDrop) -> Judgement:
        """Judge the joint that fails first."""
        life = drop.failure.life
        if life is None:
            return Judgement(self.name, why="needs shock.failure.life")
        record = life_of(life, drop.history)
        if life.required is None:
            why = "informative: shock.failure.life.required is not given"
            return Judgement(self.name, life.source, record["least"], why=why, joint=record["joint"])
        why = f"N = {life.constant:.4g} s^-{life.exponent:g}, scatter factor {life.scatter:g}; the lower end is judged"
        joint, required = record["joint"], float(life.required)
        return Judgement(self.name, life.source, record["least"], required, "", why, joint, is_least=True)


def life_of(life: Life, history: Arrays) -> dict:
    """Return the drops to failure of the joint that fails first by the law of life.

    Args:
        life: Law N = C s^-m of drops N by the measure s, with its scatter.
        history: Arrays of ``history.npz``, in which the joint with the largest peak of the measure is found.

    Returns:
        ``joint``, ``measure`` (name), ``value`` (peak, SI), ``source``, and ``drops`` with the scatter band ``least``
        and ``most``; these three are None if no peak is positive.
    """
    measure = MEASURES[life.measure]
    peaks = measure.peaks(history)
    column = int(np.argmax(peaks))
    value = float(peaks[column])
    drops, least, most = life.drops(SHOWN[measure.unit][0] * value) if value > 0.0 else (None, None, None)
    record = {"joint": str(history["joints"][column]), "measure": life.measure, "value": value, "source": life.source}
    return record | {"drops": drops, "least": least, "most": most}
