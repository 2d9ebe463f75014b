"""All effects of the program, in the order of the pipeline: each package says what its own are."""

from functools import cache

from reflowshock.workflow.effects.effect import Effect

# Names that a stage gives to effects of which an earlier stage has one of the same name.
APART = "_in_the_shock"


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
