"""Effects: optional physics of a scene, each a class; inactive effects are absent from the solver."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Generic, Literal, NotRequired, TypedDict, TypeVar

from reflowshock.parameters import with_value

Switch = Literal["auto", "on", "off"]
Scene = TypeVar("Scene", contravariant=True)
SET_IN_CASE = "none: set in the case file"


class Decision(TypedDict):
    """Decision on an effect: state, reason and, if predicted, its expected relative influence on the result.

    Damping has its ratio of critical damping, too.
    """

    on: bool
    why: str
    influence: NotRequired[float]
    ratio: NotRequired[float]


def decision(on: bool, why: str, influence: float | None = None, ratio: float | None = None) -> Decision:
    """Return a decision as a plain dictionary for plans and results.

    Args:
        on: Whether the effect acts.
        why: Reason in words.
        influence: Expected relative change of the result by the effect; None, if it is not predicted, omits the key.
        ratio: Damping ratio, a share of critical damping; None, for all other effects, omits the key.

    Returns:
        Dictionary with the keys ``on``, ``why`` and, if given, ``influence`` and ``ratio``.
    """
    result: Decision = {"on": bool(on), "why": why}
    if influence is not None:
        result["influence"] = float(influence)
    if ratio is not None:
        result["ratio"] = float(ratio)
    return result


@dataclass(frozen=True, slots=True)
class Toggle:
    """Dotted key of a case that toggles an effect, and its values with and without the effect."""

    key: str
    on: object
    off: object


class Effect(ABC, Generic[Scene]):
    """Effect of the model. Effects without an ``implementation`` are loads or parts of the method and not listed.

    Attributes:
        name: Name in plans, reports and ``summary.json``.
        stage: Stage in which it acts.
        adds: Term that it adds to the equations.
        number: Dimensionless number that decides on it.
        influence: Expected relative change of the result, as a formula of the number.
        implementation: Dotted name of the object that acts, or of the function that decides.
        switch: Key of the case file, and its values.
        source: Source of the number or the law.
        acts: Whether it acts above or below the threshold.
        threshold: Threshold of the number; None if the case specifies the effect explicitly.
        toggle: Key and values that toggle it, if the forecast includes its cost, otherwise None.
    """

    name: str
    stage: str = "shock"
    adds: str = ""
    number: str = SET_IN_CASE
    influence: str = ""
    implementation: str = ""
    switch: str = ""
    source: str = ""
    acts: Literal["above", "below"] = "above"
    threshold: float | None = None
    toggle: Toggle | None = None

    @abstractmethod
    def decide(self, scene: Scene) -> Decision:
        """Decide whether the effect acts in a scene."""

    def toggled(self, case: Any, acts: bool) -> Any | None:
        """Return the case with the effect toggled, or None if its cost cannot be predicted."""
        if self.toggle is None:
            return None
        return with_value(case, self.toggle.key, self.toggle.off if acts else self.toggle.on)


def decide_all(effects: Iterable[Effect[Scene]], scene: Scene) -> dict[str, Decision]:
    """Return the decision on each effect in a scene.

    Args:
        effects: Effects to decide on.
        scene: Parameters of the case, which ``decide`` of each effect takes.

    Returns:
        Effect name -> decision (state, reason and expected influence), in the given order.
    """
    return {effect.name: effect.decide(scene) for effect in effects}
