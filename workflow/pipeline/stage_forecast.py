"""The forecast of any case, from its parameters alone: wall time of its stages, its effects."""

from reflowshock.workflow.board_drop.case import PackageCase
from reflowshock.workflow.board_drop.forecast import Forecast, forecast
from reflowshock.workflow.case.kind import Case
from reflowshock.workflow.solder.forecast import SceneForecast, forecast_scene
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.forecast import StructureForecast, forecast_structure


def stage_seconds(case: Case) -> dict[str, float]:
    """Predict the wall time [s] of each stage of which there is a prediction."""
    return _forecast_of(case).seconds


def scene_effects(case: Case) -> dict:
    """Return effect -> {"on", "why"} and, where it is foreseen, "influence"."""
    return dict(_forecast_of(case).effects)


def _forecast_of(case: Case) -> Forecast | StructureForecast | SceneForecast:
    if isinstance(case, PackageCase):
        return forecast(case)
    if isinstance(case, StructureCase):
        return forecast_structure(case)
    return forecast_scene(case)
