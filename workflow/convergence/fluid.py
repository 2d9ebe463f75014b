"""Convergence studies of flows: particles, and the smoothing length over their spacing."""

from functools import partial
from math import ceil

from reflowshock.workflow.convergence.series import ConvergenceStudy, Parameter, StudyRun
from reflowshock.workflow.convergence.solder import of_metrics
from reflowshock.workflow.fluid.case import DropletCase, FlowCase, PrintingCase

ACROSS = {
    "dam_break": (20, 28, 40, 56), "poiseuille": (10, 14, 20, 28), "taylor_green": (16, 24, 32, 48),
    "droplet": (10, 12, 16, 20), "printing": (8, 9, 10, 12),
}  # fmt: skip
SMOOTHING = (1.2, 1.5, 2.0)
MEASURES = {
    "dam_break": ("", {"plateau_mean": "pressure of the plateau", "impact_onset": "time of the impact"}),
    "printing": ("", {"roughness_sa": "roughness Sa", "height_max": "height of the part"}),
    "poiseuille": ("starting channel", {"profile_error_at_end": "speeds across the channel"}),
    "taylor_green": ("Taylor & Green", {"decay_rate_error": "rate of decay", "speed_error": "largest speed"}),
}
OF_IMPACT = ("", {"spread_max": "largest spread"})
OF_CAP = ("spherical cap", {"base_error": "width on the wall", "height_error": "height"})
OF_FREE_DROP = ("Young-Laplace", {"pressure_error": "pressure"})
ROUNDING = 1e-9


def flow_study(case: FlowCase) -> ConvergenceStudy:
    """Particles across the scene; and at the coarsest of them the smoothing length."""
    exact, errors = measures(case)
    key, coarse = f"{case.kind}.numerics", ACROSS[case.kind][0]
    across = "particles_per_diameter" if isinstance(case, DropletCase | PrintingCase) else "particles_across"

    def at(value: float) -> StudyRun:
        count = max(8, ceil(1.0 / value - ROUNDING))
        settings = {f"{key}.{across}": f"{count}"}
        return StudyRun(f"{count} across", "particle spacing", settings, 1.0 / count)

    spacing = Parameter("particle spacing", tuple(1.0 / count for count in ACROSS[case.kind]), at)
    choices = tuple(
        StudyRun(
            f"smoothing {value:g}", "smoothing length",
            {f"{key}.{across}": f"{coarse}", f"{key}.smoothing_length": f"{value:g}"},
        )
        for value in SMOOTHING
    )  # fmt: skip
    measure = partial(of_metrics, exact, errors, "particles")
    return ConvergenceStudy("particles", ("particles",), errors, measure, (spacing,), choices)


def measures(case: FlowCase) -> tuple[str, dict[str, str]]:
    """Return the exact solution, empty where there is none, and the metrics that are measured."""
    if not isinstance(case, DropletCase):
        return MEASURES[case.kind]
    if case.droplet.impact_speed:
        return OF_IMPACT
    return OF_CAP if case.droplet.has_wall else OF_FREE_DROP
