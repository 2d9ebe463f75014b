"""Wall time of the stages of any case, from its parameters alone."""

from workflow.board_drop_case import PackageCase
from workflow.case_kind import Case
from workflow.forecast import forecast
from workflow.scene_forecast import forecast_scene
from workflow.structure.case import StructureCase
from workflow.structure.forecast import forecast_structure


def stage_seconds(case: Case) -> dict[str, float]:
    """Predict the wall time [s] of each stage of which there is a prediction."""
    if isinstance(case, PackageCase):
        return forecast(case).seconds
    if isinstance(case, StructureCase):
        return forecast_structure(case).seconds
    return forecast_scene(case).seconds
