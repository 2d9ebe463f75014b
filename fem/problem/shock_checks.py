"""Parameters of a drop shock that are each allowed but do not fit together. Loads neither numba nor DOLFINx."""

from collections.abc import Iterator

from reflowshock.fem.problem.attachment_checks import filter_problems
from reflowshock.fem.problem.kinematics import TURNING
from reflowshock.fem.problem.shock import Damping, JointCoupling, Shock
from reflowshock.problem import Problem


def problems(shock: Shock) -> list[Problem]:
    """Find what cannot work before anything is meshed or computed."""
    return [
        *_pulse(shock),
        *_beyond_the_end(shock),
        *_damping(shock.damping),
        *_large_mass(shock),
        *_finite(shock),
        *_coupling(shock.coupling),
        *_filter(shock),
    ]


def _pulse(shock: Shock) -> Iterator[Problem]:
    sine = {"shock.peak_acceleration": shock.peak_acceleration, "shock.pulse_duration": shock.pulse_duration}
    ways = {"shock.service_condition": shock.service_condition, "shock.table": shock.table} | sine
    given = [key for key, value in ways.items() if value is not None]
    if not given:
        yield Problem(
            "shock.peak_acceleration",
            "is missing",
            None,
            "peak_acceleration and pulse_duration, service_condition, table",
        )
    elif set(given) <= set(sine):
        for key in set(sine) - set(given):
            yield Problem(key, "is missing", None, "> 0; a half sine has peak_acceleration and pulse_duration")
    elif len(given) > 1:
        extra = given[1]
        yield Problem(extra, f"does not go with {given[0]}, which says what the pulse is", ways[extra], "one of them")


def _damping(damping: Damping) -> Iterator[Problem]:
    ratios = {"mass_ratio": damping.mass_ratio, "stiffness_ratio": damping.stiffness_ratio}
    used = [name for name, value in ratios.items() if value]
    if used and damping.frequency is None:
        yield Problem("shock.damping.frequency", f"is missing: at which {' and '.join(used)} is meant", None, "> 0 Hz")


def _filter(shock: Shock) -> Iterator[Problem]:
    if "filter" in shock.model_fields_set:
        duration = 0.0 if shock.duration == "auto" else shock.duration
        yield from filter_problems("shock", shock.filter, duration, shock.numerics.history_samples)


def _beyond_the_end(shock: Shock) -> Iterator[Problem]:
    """Find times after the end of the shock, where that is given."""
    if shock.duration == "auto":
        return
    ends = {"shock.numerics.dns_duration": shock.numerics.dns_duration, "shock.picture_times": shock.picture_times}
    for key, given in ends.items():
        latest = max(given, default=0.0) if isinstance(given, tuple) else given or 0.0
        if latest > shock.duration:
            yield Problem(key, "is after the end of the shock", given, "<= shock.duration")


def _large_mass(shock: Shock) -> Iterator[Problem]:
    if shock.method == "large_mass" and shock.damping.coefficients[0]:
        yield Problem(
            "shock.method",
            "does not go with mass-proportional damping, which would brake the moving table",
            shock.method,
            "direct, or stiffness-proportional damping",
        )


def _finite(shock: Shock) -> Iterator[Problem]:
    """Find what is linear: stiffness-proportional damping, which would brake what turns, and implicit steps."""
    if shock.numerics.kinematics in TURNING and shock.damping.coefficients[1]:
        yield Problem(
            "shock.numerics.kinematics",
            "does not go with stiffness-proportional damping, whose stiffness does not turn",
            shock.numerics.kinematics,
            "small, or mass-proportional damping",
        )
    if shock.numerics.kinematics in TURNING and shock.numerics.dns_solver == "implicit":
        what = "is not for implicit steps, which are linear"
        yield Problem("shock.numerics.kinematics", what, shock.numerics.kinematics, "small, or dns_solver = explicit")


def _coupling(coupling: JointCoupling) -> Iterator[Problem]:
    """Refuse schemes that need an answer, or to be the whole model, where nothing is answered."""
    if coupling.direction == "one_way" and coupling.scheme not in ("auto", "held_velocity"):
        yield Problem(
            "shock.coupling.scheme", "does not go with direction = one_way", coupling.scheme, "auto, held_velocity"
        )
