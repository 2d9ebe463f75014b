"""Sizes, time steps and cost of a run, from its parameters alone."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from fem.materials.parameters import Material
from fem.materials.roles import Materials
from workflow.board_drop_case import BoardDropCase
from workflow.case import available_cores
from workflow.problems import Problem
from workflow.reflow_pool import distinct_geometries, joint_geometries
from workflow.step_limit import too_many_steps

MACRO = "board"  # the part of the macro model; all others belong to the meso model


@dataclass(frozen=True, slots=True)
class PartForecast:
    """A part of the mesh: its hexahedra, the critical time step of the smallest [s], whether its mass is scaled."""

    elements: int
    critical_step: float
    mass_scaled: bool


@dataclass(frozen=True, slots=True)
class ShockForecast:
    """Time steps and wall time of the shock.

    Attributes:
        window: step of the macro model [s].
        substeps: m, meso steps a window.
        windows: number of windows.
        two_scale: predicted wall time of the two-scale run [s].
        dns: predicted wall time of the DNS [s] in explicit steps.
        implicit: the same in implicit steps on one rank, where everything is elastic.
        updates_per_second: element updates per second and rank that the prediction assumes.
    """

    window: float
    substeps: int
    windows: int
    two_scale: float
    dns: float
    implicit: float
    updates_per_second: float


@dataclass(frozen=True, slots=True)
class Forecast:
    """What a run will be like.

    Attributes:
        effects: effect -> {"on", "why"}; those of the reflow at the joint with the largest gap.
        joints: number of joints.
        distinct: number of joints that have to be computed.
        particles: smallest and largest number of particles of a joint.
        parts: part of the mesh -> its size and step.
        shock: time steps and wall time.
        seconds: stage -> predicted wall time [s], where there is a prediction.
    """

    effects: dict
    joints: int
    distinct: int
    particles: tuple[int, int]
    parts: dict[str, PartForecast]
    shock: ShockForecast
    seconds: dict[str, float]


def forecast(case: BoardDropCase) -> Forecast:
    """Predict sizes, time steps and cost of a run."""
    from fem.materials.effects import failure_effect, material_effects
    from meshing.pads import pad_table
    from particles.effects import decide_effects
    from particles.estimate import particle_count, reflow_seconds

    geometries = joint_geometries(pad_table(case.package, case.board, case.warpage))
    distinct = list(distinct_geometries(geometries).values())
    counts = [particle_count(case.solder, geometry) for geometry in distinct]
    workers = min(available_cores(), len(distinct))
    reflow = sum(reflow_seconds(case.solder, geometry) for geometry in distinct) / workers
    parts = forecast_parts(case)
    shock = forecast_shock(case, parts)
    numerics = case.shock.numerics
    dns = shock.implicit if numerics.dns_solver == "implicit" else shock.dns
    wall = sum(seconds for mode, seconds in (("two_scale", shock.two_scale), ("dns", dns)) if mode in numerics.modes)
    return Forecast(
        effects=decide_effects(max(distinct, key=lambda geometry: geometry.gap), case.solder)
        | material_effects(case.materials.by_role)
        | failure_effect(case.shock.failure),
        joints=len(geometries),
        distinct=len(distinct),
        particles=(min(counts), max(counts)),
        parts=parts,
        shock=shock,
        seconds={"reflow": reflow, "shock": wall},
    )


def forecast_parts(case: BoardDropCase) -> dict[str, PartForecast]:
    """Predict size and critical time step of every part of the mesh."""
    import numpy as np

    from fem.estimate import box_critical_step
    from meshing.estimate import count_elements

    scaled = case.shock.numerics.mass_scaled
    return {
        name: PartForecast(
            part.elements, box_critical_step(material_of(case, name), np.array(part.smallest)), role_of(name) in scaled
        )
        for name, part in count_elements(case.package, case.board, case.warpage).items()
    }


def step_problems(case: BoardDropCase) -> Iterator[Problem]:
    """Find more steps than any run takes."""
    import numpy as np

    from fem.estimate import damped_critical_step

    with np.errstate(all="ignore"):
        steps = [part.critical_step for part in forecast_parts(case).values() if not part.mass_scaled]
        step = damped_critical_step(min(steps), case.shock.damping.coefficients[1]) if steps else math.inf
    yield from too_many_steps("shock.duration", case.shock.duration, step, "explicit")


def forecast_shock(case: BoardDropCase, parts: dict[str, PartForecast]) -> ShockForecast:
    """Predict the time steps and the wall time of the shock.

    Scaled masses follow the smallest step of the others, so they do not limit it. The board's patch touches the cut: it
    limits the window, as the board does.
    """
    from fem.estimate import (
        UPDATES_PER_SECOND,
        damped_critical_step,
        implicit_plan,
        largest_implicit_step,
        predict_seconds,
        window_plan,
    )
    from fem.solver_cost import implicit_cost, plate_nodes

    shock, numerics = case.shock, case.shock.numerics
    macro = min(part.critical_step for name, part in parts.items() if role_of(name) == MACRO)
    limiting = [part.critical_step for part in parts.values() if not part.mass_scaled]
    meso_step = min(limiting, default=macro)
    macro, meso_step = (damped_critical_step(step, shock.damping.coefficients[1]) for step in (macro, meso_step))
    plan = window_plan(macro, meso_step, numerics.step_fraction, shock.duration, numerics.history_samples)
    board, meso = parts[MACRO].elements, sum(part.elements for name, part in parts.items() if name != MACRO)
    work = round(sum(part.elements * relative_cost(case, name) for name, part in parts.items() if name != MACRO))
    two_scale, dns = predict_seconds(board, [(work, plan.substeps)], plan, shock.ranks)
    pulses = [shock.pulse_duration] if shock.pulse_duration else []
    slow = implicit_plan(plan, largest_implicit_step(shock.duration, pulses))
    implicit = implicit_cost(plate_nodes(board + meso), slow.windows * slow.substeps).seconds
    return ShockForecast(plan.window, plan.substeps, plan.windows, two_scale, dns, implicit, UPDATES_PER_SECOND)


def implicit_seconds(case: BoardDropCase) -> float | None:
    """Predict the wall time of a DNS in implicit steps on one rank; None where something is not linear."""
    parts = forecast_parts(case)
    is_linear = all(relative_cost(case, name) == 1.0 for name in parts)
    return forecast_shock(case, parts).implicit if is_linear else None


def relative_cost(case: BoardDropCase, part: str) -> float:
    """Return the cost of an element of a part over that of an elastic one: what yields or turns has a path."""
    from fem.estimate import UPDATES_PER_SECOND
    from fem.solver_cost import NONLINEAR_RATE

    numerics = case.shock.numerics
    has_path = material_of(case, part).plasticity is not None or numerics.kinematics == "finite"
    return UPDATES_PER_SECOND / NONLINEAR_RATE[numerics.formulation] if has_path else 1.0


def with_critical_step(quality: dict, materials: Materials) -> dict:
    """Add the critical time step [s] to the quality of a joint mesh, from the shortest length in each material."""
    import numpy as np

    from fem.estimate import box_critical_step

    steps = {
        role: box_critical_step(getattr(materials, role), np.full(3, length))
        for role, length in quality["smallest_length"].items()
    }
    return {**quality, "critical_time_step": min(steps.values()), "critical_time_steps": steps}


def role_of(part: str) -> str:
    """Return the material role of a part: its name up to "@", then up to "_"."""
    return part.split("@")[0].split("_")[0]


def material_of(case: BoardDropCase, part: str) -> Material:
    """Return the material of a part."""
    return getattr(case.materials, role_of(part))
