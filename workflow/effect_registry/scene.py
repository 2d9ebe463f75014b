"""The effects of a case, as its forecast decides them."""

from workflow.board_drop_case import PackageCase
from workflow.case_kind import Case
from workflow.structure.case import StructureCase


def scene_effects(case: Case) -> dict:
    """Return effect -> {"on", "why"} and, where it is foreseen, "influence"."""
    if isinstance(case, PackageCase):
        from workflow.forecast import forecast

        return forecast(case).effects
    if isinstance(case, StructureCase):
        from workflow.structure.forecast import forecast_structure

        return dict(forecast_structure(case).effects)
    from workflow.scene_forecast import forecast_scene

    return dict(forecast_scene(case).effects)
