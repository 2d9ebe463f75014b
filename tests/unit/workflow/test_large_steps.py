"""Load steps at rest are computed in large time steps, unless the case says how large."""

import pytest

from reflowshock.particles.parameters.solder import SolderNumerics
from reflowshock.workflow.package.case import LARGE_STEPS
from reflowshock.workflow.pipeline.reader import read_case
from tests.support.workflow_command import SMALL_CASE

HEATED = ('warpage.corner="0 mm"', 'thermal.peak="245 degC"')


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ((), SolderNumerics().time_step_limit),
        (HEATED, LARGE_STEPS),
        ((*HEATED, "solder.numerics.time_step_limit=30"), 30.0),
    ],
)
def test_steps_of_a_case(settings, expected):
    case = read_case(SMALL_CASE, settings, oversubscribe=True)
    assert case.solder.numerics.time_step_limit == expected
    again = type(case).model_validate(case.model_dump(mode="json"))
    assert again.solder.numerics == case.solder.numerics


def test_an_invalid_table_is_rejected():
    with pytest.raises(ValueError, match="solder"):
        read_case(SMALL_CASE, (*HEATED, "solder=3"), oversubscribe=True)
