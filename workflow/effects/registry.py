"""All effects of the program, in the order of the pipeline: each package says what its own are."""

from dataclasses import dataclass
from functools import cache

# Names that a stage gives to effects of which an earlier stage has one of the same name.
APART = "_in_the_shock"


@dataclass(frozen=True, slots=True)
class Effect:
    """An effect: an object in a list, absent where the case does not call for it.

    Attributes:
        name: as in plans, reports and ``summary.json``.
        stage: in which it acts.
        adds: what it adds to the equations.
        number: its dimensionless number.
        influence: expected relative change of the answer, as a formula of the number.
        place: dotted name of the object, or of the function that decides.
        switch: the key of a case file, and its values.
        source: of the number or the law.
        acts: whether it acts above or below the threshold.
        threshold: of the number; None where the case says itself whether the effect is there.
    """

    name: str
    stage: str
    adds: str
    number: str
    influence: str
    place: str
    switch: str
    source: str
    acts: str = "above"
    threshold: float | None = None


@cache
def registry() -> dict[str, Effect]:
    """Return the effects by name."""
    from reflowshock.fem.estimates.effect_entries import ENTRIES as OF_STAGES
    from reflowshock.particles.parameters.effects import ENTRIES as OF_LIQUID

    entries = {"reflow": (*OF_LIQUID, *OF_STAGES["reflow"]), "shock": OF_STAGES["shock"]}
    found = [Effect(stage=stage, **entry) for stage, members in entries.items() for entry in members]
    return {effect.name: effect for effect in found}


def effect_of(name: str, reflowed: bool) -> Effect | None:
    """Return the effect of a name in a plan or record; None for what is a load or a part of the method.

    Args:
        name: in the plan.
        reflowed: whether the case has a reflow, whose effects come first where names are equal.
    """
    known = registry()
    return known.get(name if reflowed else f"{name}{APART}", known.get(name))
