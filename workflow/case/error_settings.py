"""Parameters of the error estimate of a run, the table ``[numerics.error]`` of a case."""

from typing import Literal

from reflowshock.parameters import Parameters

Method = Literal["estimate", "measured", "off"]


class ErrorEstimate(Parameters):
    """Origin of the discretisation errors of a run.

    ``estimate`` runs the case on two coarser meshes. ``measured`` takes the errors of ``reflowshock accuracy``. ``off``
    reports none.
    """

    method: Method = "estimate"


class CaseNumerics(Parameters):
    """Numerical settings of a whole case."""

    error: ErrorEstimate = ErrorEstimate()
