"""Registry of all effects in the order of the pipeline, collected from the packages."""

from functools import cache

from reflowshock.effect import Effect

# Suffix of an effect whose name an earlier stage already uses.
SHOCK_SUFFIX = "_in_the_shock"


@cache
def registry() -> dict[str, Effect]:
    """Return the effects of reflow, heating, drop and flow by name; the order is that of these kinds.

    Returns:
        Name -> stage, governing term, dimensionless number, influence and switch of the effect.
    """
    from reflowshock.workflow.flows.registry import FLOWS
    from reflowshock.workflow.kinds import BOARD_DROP

    stages = list(BOARD_DROP.stages)
    of_drops = sorted(BOARD_DROP.effects, key=lambda effect: stages.index(effect.stage))
    of_flows = (effect for flow in FLOWS for effect in flow.effects)
    return {effect.name: effect for effect in (*of_drops, *of_flows)}


def effect_of(name: str, reflowed: bool) -> Effect | None:
    """Return the effect with a name in a plan or record, or None for loads and parts of the method.

    Args:
        name: Name in the plan or record.
        reflowed: Whether the case has a reflow, whose effects take precedence if names are equal.
    """
    effects = registry()
    return effects.get(name if reflowed else f"{name}{SHOCK_SUFFIX}", effects.get(name))
