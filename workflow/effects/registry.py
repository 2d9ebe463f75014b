"""All effects of the program, in the order of the pipeline: each package lists its own."""

from functools import cache

from reflowshock.effect import Effect

# Names that a stage gives to effects of which an earlier stage has one of the same name.
APART = "_in_the_shock"


@cache
def registry() -> dict[str, Effect]:
    """Return the effects by name: those of reflows, of heating, of drops and of flows."""
    from reflowshock.workflow.flows.registry import FLOWS
    from reflowshock.workflow.kinds import BOARD_DROP

    stages = list(BOARD_DROP.stages)
    of_drops = sorted(BOARD_DROP.effects, key=lambda effect: stages.index(effect.stage))
    of_flows = (effect for flow in FLOWS for effect in flow.effects)
    return {effect.name: effect for effect in (*of_drops, *of_flows)}


def effect_of(name: str, reflowed: bool) -> Effect | None:
    """Return the effect of a name in a plan or record; None for what is a load or a part of the method.

    Args:
        name: in the plan.
        reflowed: whether the case has a reflow, whose effects come first where names are equal.
    """
    known = registry()
    return known.get(name if reflowed else f"{name}{APART}", known.get(name))
