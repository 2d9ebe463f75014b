"""Forecast of sizes, time steps and cost of a run, from the case alone."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from reflowshock.fem.problem.thermal import Thermal
from reflowshock.materials.roles import Materials
from reflowshock.problem import Problem
from reflowshock.workflow.board_drop import shock_cooling
from reflowshock.workflow.board_drop.board_deflection import decided, expected_duration, expected_search
from reflowshock.workflow.board_drop.duration import longest_duration
from reflowshock.workflow.board_drop.part_forecast import (
    PartForecast,
    forecast_parts,
    two_scale_parts,
)
from reflowshock.workflow.board_drop.shock_effects import shock_effects
from reflowshock.workflow.board_drop.shock_forecast import (
    ShockForecast,
    forecast_shock,
    mode_seconds,
    search_seconds,
    seconds_outside_windows,
    shorter_than_window,
)
from reflowshock.workflow.case.forecast import (
    BYTES_OF_ELEMENT,
    BYTES_OF_PARTICLE,
    SECONDS_OF_STAGE,
    Size,
    too_many_steps,
)
from reflowshock.workflow.package.case import BoardDropCase, PackageCase
from reflowshock.workflow.process.environment import available_cores
from reflowshock.workflow.reflow.forecast import forecast_heated
from reflowshock.workflow.reflow.joints import distinct_joints


@dataclass(frozen=True, slots=True)
class PackageForecast:
    """Forecast of a run.

    Attributes:
        effects: Decision ("on", "why") of each effect; for the reflow, at the joint with the largest gap.
        joints: Number of joints.
        distinct: Number of joints that are computed.
        particles: Smallest and largest number of particles of a joint.
        parts: Size and time step of each part of the mesh, in the two-scale run if there is one.
        shock: Time steps and wall time of the shock; None without a shock.
        seconds: Predicted wall time of each stage [s], where there is a prediction.
        load_steps: Load steps with liquid solder; 0 without ``[thermal]``.
        search: Predicted wall time of the search for critical joints and the end [s], part of the stage shock; zero
            without one.
    """

    effects: dict
    joints: int
    distinct: int
    particles: tuple[int, int]
    parts: dict[str, PartForecast]
    shock: ShockForecast | None
    seconds: dict[str, float]
    load_steps: int = 0
    search: float = 0.0


def forecast_package(case: PackageCase) -> PackageForecast:
    """Predict sizes and cost of the reflow of a package from its case, without running it.

    Returns:
        Number and particles of the joints, effects, and wall time of each stage [s]; ``parts`` is empty, ``shock``
        None.
    """
    from reflowshock.particles.parameters.effects import decide_effects
    from reflowshock.particles.parameters.estimate import particle_count, reflow_seconds

    geometries = case.joints
    user_surfaces = () if case.thermal else case.package.surfaces
    flowing = {name: geometry for name, geometry in geometries.items() if name not in user_surfaces}
    distinct = [group.geometry for group in distinct_joints(flowing)]
    counts = [particle_count(case.solder, geometry) for geometry in distinct]
    workers = max(1, min(available_cores(), len(distinct)))
    reflow = PackageForecast(
        effects=decide_effects(max(geometries.values(), key=lambda geometry: geometry.gap), case.solder),
        joints=len(geometries),
        distinct=len(distinct),
        particles=(min(counts, default=0), max(counts, default=0)),
        parts={},
        shock=None,
        seconds={
            "reflow": SECONDS_OF_STAGE + sum(reflow_seconds(case.solder, geometry) for geometry in distinct) / workers
        },
    )
    return reflow if case.thermal is None else _heated(reflow, case, case.thermal)


def _heated(reflow: PackageForecast, case: PackageCase, thermal: Thermal) -> PackageForecast:
    """Predict a reflow in load steps, assuming that warpage makes all joints distinct."""
    heated = forecast_heated(case, thermal)
    share, liquid = reflow.joints / reflow.distinct, reflow.seconds["reflow"] - SECONDS_OF_STAGE
    return replace(
        reflow,
        effects=reflow.effects | heated.effects,
        distinct=reflow.joints,
        load_steps=len(heated.steps),
        seconds={"reflow": SECONDS_OF_STAGE + share * heated.exchanges * liquid},
    )


def forecast_board_drop(case: BoardDropCase) -> PackageForecast:
    """Predict sizes, time steps and cost of reflow and shock, without running them.

    Returns:
        Number and particles of the joints, effects, wall time of each stage [s], elements and critical time step of
        each part of the mesh, and scheme, time steps and wall times of the shock.
    """
    reflow = forecast_package(case)
    longest = longest_duration(case)
    share, search = expected_duration(case) / longest, search_seconds(case, expected_search(case) / longest)
    drop_effects, case = shock_effects(case), decided(case)
    parts = forecast_parts(case)
    shock = forecast_shock(case, parts, share)
    numerics = case.shock.numerics
    dns = shock.implicit if numerics.dns_solver == "implicit" else shock.dns
    cooling, seconds = shock_cooling.forecast(case, parts)
    once = seconds + mode_seconds(case)
    modes = {
        "two_scale": share * shock.two_scale + seconds_outside_windows(case, two_scale_parts(case), share),
        "dns": share * dns + seconds_outside_windows(case, parts, share * shock.dns_share),
    }
    again = modes["two_scale" if "two_scale" in numerics.modes else "dns"]
    modes["two_scale"] += search
    identical = again if case.shock.identical_joints else 0.0
    return replace(
        reflow,
        effects=reflow.effects | drop_effects | cooling,
        parts=two_scale_parts(case) if "two_scale" in numerics.modes else parts,
        shock=shock,
        search=search,
        seconds=reflow.seconds | {"shock": sum(modes[mode] for mode in numerics.modes) + identical + once},
    )


def step_problems(case: BoardDropCase) -> Iterator[Problem]:
    """Yield problems of too many time steps, and of a pulse or duration shorter than a window.

    A window is the time between two exchanges of the macro model (board) and the meso model (joints).

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    import numpy as np

    from reflowshock.fem.estimates.estimate import damped_critical_step

    case = decided(case)

    with np.errstate(all="ignore"):
        smallest = min(part.scaled_step for part in forecast_parts(case).values())
        step = damped_critical_step(smallest, case.shock.damping.coefficients[1])
    yield from (problems := list(too_many_steps("shock.duration", longest_duration(case), step, "explicit")))
    if not problems and "two_scale" in case.shock.numerics.modes:
        yield from shorter_than_window(case)


def with_critical_step(quality: dict, materials: Materials) -> dict:
    """Return the quality of a joint mesh with its critical time steps, from the shortest length in each material.

    Args:
        quality: Measures of the mesh, among them ``smallest_length``: material role -> length [m].
        materials: Materials by role.

    Returns:
        Copy with ``critical_time_step`` (the smallest) and ``critical_time_steps`` by role [s].
    """
    import numpy as np

    from reflowshock.fem.estimates.estimate import box_critical_step

    steps = {
        role: box_critical_step(getattr(materials, role), np.full(3, length))
        for role, length in quality["smallest_length"].items()
    }
    return {**quality, "critical_time_step": min(steps.values()), "critical_time_steps": steps}


def package_size(case: PackageCase) -> Size:
    """Predict time and memory of the stages of a package on one core.

    Returns:
        Seconds by stage, number of joints that can be computed at the same time, and memory [B].
    """
    return _size(forecast_package(case))


def board_drop_size(case: BoardDropCase) -> Size:
    """Predict time and memory of the stages of a board drop on one core.

    Returns:
        Seconds by stage, number of joints that can be computed at the same time, and memory [B].
    """
    return _size(forecast_board_drop(case))


def _size(outlook: PackageForecast) -> Size:
    """Return the size of a forecast, whose reflow is that on all cores of this machine."""
    from reflowshock.fem.estimates.solver_cost import cooling_cost

    joints = max(1, outlook.distinct)
    elements = sum(part.elements for part in outlook.parts.values())
    memory = BYTES_OF_ELEMENT * elements + BYTES_OF_PARTICLE * outlook.particles[1]
    if elements and outlook.effects.get("residual_stress", {}).get("on"):
        memory += cooling_cost(elements, 0).memory
    reflow = outlook.seconds["reflow"] * min(available_cores(), joints)
    return Size({**outlook.seconds, "reflow": reflow}, joints, memory)
