"""Sizes, time steps and cost of a run, from its parameters alone."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from reflowshock.fem.problem.thermal import Thermal
from reflowshock.materials.roles import Materials
from reflowshock.problem import Problem
from reflowshock.workflow.board_drop import shock_cooling
from reflowshock.workflow.board_drop.board_deflection import decided, expected_duration
from reflowshock.workflow.board_drop.duration import longest_duration
from reflowshock.workflow.board_drop.part_forecast import (
    PartForecast,
    coarse_parts,
    forecast_parts,
    two_scale_parts,
)
from reflowshock.workflow.board_drop.shock_effects import shock_effects
from reflowshock.workflow.board_drop.shock_forecast import (
    ShockForecast,
    forecast_shock,
    mode_seconds,
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
    """What a run will be like.

    Attributes:
        effects: effect -> {"on", "why"}; those of the reflow at the joint with the largest gap.
        joints: number of joints.
        distinct: number of joints that have to be computed.
        particles: smallest and largest number of particles of a joint.
        parts: part of the mesh -> its size and step in the shock; those of the two-scale run where there is one.
        shock: time steps and wall time; None without a shock.
        seconds: stage -> predicted wall time [s], where there is a prediction.
        load_steps: of a reflow with temperatures, those with liquid solder; else 0.
    """

    effects: dict
    joints: int
    distinct: int
    particles: tuple[int, int]
    parts: dict[str, PartForecast]
    shock: ShockForecast | None
    seconds: dict[str, float]
    load_steps: int = 0


def forecast(case: PackageCase) -> PackageForecast:
    """Predict sizes, time steps and cost of a run."""
    from reflowshock.particles.parameters.effects import decide_effects
    from reflowshock.particles.parameters.estimate import particle_count, reflow_seconds

    geometries = case.joints
    given = () if case.thermal else case.package.surfaces
    flowing = {name: geometry for name, geometry in geometries.items() if name not in given}
    distinct = [group.geometry for group in distinct_joints(flowing)]
    counts = [particle_count(case.solder, geometry) for geometry in distinct]
    workers = max(1, min(available_cores(), len(distinct)))
    of_reflow = PackageForecast(
        effects=decide_effects(max(geometries.values(), key=lambda geometry: geometry.gap), case.solder),
        joints=len(geometries),
        distinct=len(distinct),
        particles=(min(counts, default=0), max(counts, default=0)),
        parts={},
        shock=None,
        seconds={"reflow": SECONDS_OF_STAGE + sum(reflow_seconds(case.solder, one) for one in distinct) / workers},
    )
    of_reflow = of_reflow if case.thermal is None else _heated(of_reflow, case, case.thermal)
    return _with_shock(of_reflow, case) if isinstance(case, BoardDropCase) else of_reflow


def _heated(of_reflow: PackageForecast, case: PackageCase, thermal: Thermal) -> PackageForecast:
    """Predict a reflow in load steps: how many joints the structure makes distinct is not known, all may be."""
    heated = forecast_heated(case, thermal)
    share, liquid = of_reflow.joints / of_reflow.distinct, of_reflow.seconds["reflow"] - SECONDS_OF_STAGE
    return replace(
        of_reflow,
        effects=of_reflow.effects | heated.effects,
        distinct=of_reflow.joints,
        load_steps=len(heated.steps),
        seconds={"reflow": SECONDS_OF_STAGE + share * heated.exchanges * liquid},
    )


def _with_shock(of_reflow: PackageForecast, case: BoardDropCase) -> PackageForecast:
    share = expected_duration(case) / longest_duration(case)
    of_shock, case = shock_effects(case), decided(case)
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
    if shock.search:
        modes["two_scale"] += share * shock.search + seconds_outside_windows(case, coarse_parts(case), share)
    identical = again if case.shock.identical_joints else 0.0
    return replace(
        of_reflow,
        effects=of_reflow.effects | of_shock | cooling,
        parts=two_scale_parts(case) if "two_scale" in numerics.modes else parts,
        shock=shock,
        seconds=of_reflow.seconds | {"shock": sum(modes[mode] for mode in numerics.modes) + identical + once},
    )


def step_problems(case: BoardDropCase) -> Iterator[Problem]:
    """Find more steps than any run takes, and what is over before two models meet again."""
    import numpy as np

    from reflowshock.fem.estimates.estimate import damped_critical_step

    case = decided(case)

    with np.errstate(all="ignore"):
        smallest = min(part.scaled_step for part in forecast_parts(case).values())
        step = damped_critical_step(smallest, case.shock.damping.coefficients[1])
    yield from (found := list(too_many_steps("shock.duration", longest_duration(case), step, "explicit")))
    if not found and "two_scale" in case.shock.numerics.modes:
        yield from shorter_than_window(case)


def with_critical_step(quality: dict, materials: Materials) -> dict:
    """Add the critical time step [s] to the quality of a joint mesh, from the shortest length in each material."""
    import numpy as np

    from reflowshock.fem.estimates.estimate import box_critical_step

    steps = {
        role: box_critical_step(getattr(materials, role), np.full(3, length))
        for role, length in quality["smallest_length"].items()
    }
    return {**quality, "critical_time_step": min(steps.values()), "critical_time_steps": steps}


def package_size(case: PackageCase) -> Size:
    """Predict what the stages of a case take on one core: the forecast is that of this machine's cores."""
    from reflowshock.fem.estimates.solver_cost import cooling_cost

    outlook = forecast(case)
    joints = max(1, outlook.distinct)
    elements = sum(part.elements for part in outlook.parts.values())
    memory = BYTES_OF_ELEMENT * elements + BYTES_OF_PARTICLE * outlook.particles[1]
    if elements and outlook.effects.get("residual_stress", {}).get("on"):
        memory += cooling_cost(elements, 0).memory
    reflow = outlook.seconds["reflow"] * min(available_cores(), joints)
    return Size({**outlook.seconds, "reflow": reflow}, joints, memory)
