"""Effects: physics that a scene may call for. Each is one class in the list of its kind; one that is off is absent."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Generic, Literal, NotRequired, TypedDict, TypeVar

from reflowshock.parameters import changed

Switch = Literal["auto", "on", "off"]
Scene = TypeVar("Scene", contravariant=True)
GIVEN = "none: the case says it"


class Decision(TypedDict):
    """Whether an effect acts, why, and how much of the answer it is expected to change, or would, where predicted."""

    on: bool
    why: str
    influence: NotRequired[float]


def decision(on: bool, why: str, influence: float | None = None) -> Decision:
    """Return a decision as plans and results tell it."""
    found: Decision = {"on": bool(on), "why": why}
    if influence is not None:
        found["influence"] = float(influence)
    return found


@dataclass(frozen=True, slots=True)
class Toggle:
    """The dotted key of a case that switches an effect, and its values with it and without it."""

    key: str
    on: object
    off: object


class Effect(ABC, Generic[Scene]):
    """An effect. Those without a ``place`` are loads or parts of the method, not on the page of all effects.

    Attributes:
        name: As in plans, reports and ``summary.json``.
        stage: In which it acts.
        adds: What it adds to the equations.
        number: Its dimensionless number.
        influence: Expected relative change of the answer, as a formula of the number.
        place: Dotted name of the object that acts, or of the function that decides.
        switch: The key of a case file, and its values.
        source: Of the number or the law.
        acts: Whether it acts above or below the threshold.
        threshold: Of the number; None where the case says itself whether the effect is there.
        toggle: What switches it in a case whose forecast knows its cost; None elsewhere.
    """

    name: str
    stage: str = "shock"
    adds: str = ""
    number: str = GIVEN
    influence: str = ""
    place: str = ""
    switch: str = ""
    source: str = ""
    acts: Literal["above", "below"] = "above"
    threshold: float | None = None
    toggle: Toggle | None = None

    @abstractmethod
    def decide(self, scene: Scene) -> Decision:
        """Decide whether a scene calls for it."""

    def other_way(self, case: Any, acts: bool) -> Any | None:
        """Return a case without the effect if it acts there, else with it; None if no forecast knows its cost."""
        if self.toggle is None:
            return None
        return changed(case, self.toggle.key, self.toggle.off if acts else self.toggle.on)


def decided(effects: Iterable[Effect[Scene]], scene: Scene) -> dict[str, Decision]:
    """Decide on the effects of a list; return name -> decision."""
    return {effect.name: effect.decide(scene) for effect in effects}
