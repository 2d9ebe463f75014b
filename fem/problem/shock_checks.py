"""Checks of the parameters of a drop shock that contradict each other. Imports neither numba nor DOLFINx."""

from collections.abc import Iterator

from reflowshock.fem.problem.attachment_checks import filter_problems
from reflowshock.fem.problem.kinematics import TURNING
from reflowshock.fem.problem.shock import BoardDamping, JointCoupling, Shock
from reflowshock.problem import Problem


def problems(shock: Shock) -> list[Problem]:
    """Return the contradictions between parameters of a drop shock, empty if there are none; nothing is computed.

    Args:
        shock: Parameters of the shock.

    Returns:
        Input errors, each with key, message, value and allowed range.
    """
    return [
        *_pulse(shock),
        *_beyond_the_end(shock),
        *_damping(shock.damping),
        *_finite(shock),
        *_coupling(shock.coupling),
        *_filter(shock),
    ]


def _pulse(shock: Shock) -> Iterator[Problem]:
    sine = {"shock.peak_acceleration": shock.peak_acceleration, "shock.pulse_duration": shock.pulse_duration}
    definitions = {"shock.service_condition": shock.service_condition, "shock.table": shock.table} | sine
    keys = [key for key, value in definitions.items() if value is not None]
    if not keys:
        yield Problem(
            "shock.peak_acceleration",
            "is missing",
            None,
            "peak_acceleration and pulse_duration, service_condition, table",
        )
    elif set(keys) <= set(sine):
        for key in set(sine) - set(keys):
            yield Problem(key, "is missing", None, "> 0; a half sine has peak_acceleration and pulse_duration")
    elif len(keys) > 1:
        extra = keys[1]
        message = f"cannot be combined with {keys[0]}, which already defines the pulse"
        yield Problem(extra, message, definitions[extra], "one of them")


def _damping(damping: BoardDamping) -> Iterator[Problem]:
    if damping.estimate == "on" and damping.is_given:
        message = "cannot be combined with damping that the case gives: the estimate would replace it"
        yield Problem("shock.damping.estimate", message, damping.estimate, "auto, off")
    ratios = {"mass_ratio": damping.mass_ratio, "stiffness_ratio": damping.stiffness_ratio}
    used = [name for name, value in ratios.items() if value]
    if used and damping.frequency is None:
        message = f"is missing: the frequency of {' and '.join(used)}"
        yield Problem("shock.damping.frequency", message, None, "> 0 Hz")


def _filter(shock: Shock) -> Iterator[Problem]:
    if "filter" in shock.model_fields_set:
        duration = 0.0 if shock.duration == "auto" else shock.duration
        yield from filter_problems("shock", shock.filter, duration, shock.numerics.history_samples)


def _beyond_the_end(shock: Shock) -> Iterator[Problem]:
    """Yield times after the end of the shock, if the duration is a number."""
    if shock.duration == "auto":
        return
    ends = {"shock.numerics.dns_duration": shock.numerics.dns_duration, "shock.picture_times": shock.picture_times}
    for key, times in ends.items():
        latest = max(times, default=0.0) if isinstance(times, tuple) else times or 0.0
        if latest > shock.duration:
            yield Problem(key, "is after the end of the shock", times, "<= shock.duration")


def _finite(shock: Shock) -> Iterator[Problem]:
    """Yield linear methods under finite rotations: stiffness-proportional damping and implicit steps."""
    if shock.numerics.kinematics in TURNING and shock.damping.coefficients[1]:
        yield Problem(
            "shock.numerics.kinematics",
            "cannot be combined with stiffness-proportional damping, whose stiffness does not rotate",
            shock.numerics.kinematics,
            "small, or mass-proportional damping",
        )
    if shock.numerics.kinematics in TURNING and shock.numerics.dns_solver == "implicit":
        message = "cannot be combined with implicit steps, which are linear"
        allowed = "small, or dns_solver = explicit"
        yield Problem("shock.numerics.kinematics", message, shock.numerics.kinematics, allowed)


def _coupling(coupling: JointCoupling) -> Iterator[Problem]:
    """Yield schemes that need feedback between the models, if the coupling is one-way."""
    if coupling.direction == "one_way" and coupling.scheme not in ("auto", "held_velocity"):
        message = "cannot be combined with direction = one_way"
        yield Problem("shock.coupling.scheme", message, coupling.scheme, "auto, held_velocity")
