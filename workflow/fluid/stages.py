"""The stage that lets a liquid flow; its metrics and health checks."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from reflowshock.particles.parameters.flow_effects import decide_flow
from reflowshock.workflow.case.run import Findings, Run, at_least, at_most, metric
from reflowshock.workflow.fluid.case import (
    DamBreakCase,
    DropletCase,
    FlowCase,
    PoiseuilleCase,
    PrintingCase,
    TaylorGreenCase,
)
from reflowshock.workflow.process.terminal import progress_bar

VOLUME_DRIFT = 0.02  # of the liquid, which is weakly compressible: densities stay within about 1 %
LOST = 0
ENERGY_RISE = 0.01  # of the energy at the start
PROFILE_ERROR = 0.02  # of a channel's speeds, against the exact ones
DECAY_ERROR = 0.05  # of the rate at which vortices die out
DAM_LIMITS = {"volume_drift": VOLUME_DRIFT, "particles_lost": LOST, "energy_rise": ENERGY_RISE}
CHANNEL_LIMITS = {"volume_drift": VOLUME_DRIFT, "profile_error_at_end": PROFILE_ERROR}
VORTEX_LIMITS = {"volume_drift": VOLUME_DRIFT, "decay_rate_error": DECAY_ERROR}
# What breaks off in parts too small for particles flies on without tension: as much as volumes may be wrong by.
SPRAY = 0.01
# Of the film of an impact, in spacings: particles of a thinner one are 1.4 spacings apart, half as many as they need.
THINNEST_FILM = 0.5
# Of a droplet: what its surface encloses, over that at the start, at any time.
DROPLET_LIMITS = {"volume_drift": VOLUME_DRIFT, "surface_volume_drift": 0.02, "spray_share": SPRAY}
# Of a printed part: what particles and solid bodies have of the ink; what is outside the surface of what is liquid.
PART_LIMITS = {"volume_drift": 0.01, "volume_error": 0.01, "spray_share": SPRAY}
# Of a droplet whose exact shape at rest is known.
REST_LIMITS = {"pressure_error": 0.02, "roundness": 1.02, "base_error": 0.02, "height_error": 0.02}


def flow_droplet(run: Run[DropletCase], folder: Path) -> Findings:
    """Let a droplet move."""
    from reflowshock.particles.scenes.droplet import rest_metrics, solve_droplet

    known = rest_metrics(run.case.droplet)
    limits = DROPLET_LIMITS | {name: limit for name, limit in REST_LIMITS.items() if name in known}
    found = _flow(run, folder, solve_droplet, limits)
    if film := found.metrics.get("film_over_spacing"):
        found.health["film_over_spacing"] = at_least(film["value"], THINNEST_FILM)
    return found


def flow_printing(run: Run[PrintingCase], folder: Path) -> Findings:
    """Print drops on a plate and on each other."""
    from reflowshock.particles.printing.part_files import write_part
    from reflowshock.particles.printing.printing import solve_printing
    from reflowshock.workflow.fluid.printed_part import draw_heights

    def solve(*arguments: Any) -> Any:
        result, part = solve_printing(*arguments)
        write_part(folder, part)
        draw_heights(folder / "height_map.png", part.x, part.y, part.heights)
        return result

    return _flow(run, folder, solve, PART_LIMITS)


def flow_dam_break(run: Run[DamBreakCase], folder: Path) -> Findings:
    """Let a dam break."""
    from reflowshock.particles.scenes.dam_break import solve_dam_break

    return _flow(run, folder, solve_dam_break, DAM_LIMITS)


def flow_poiseuille(run: Run[PoiseuilleCase], folder: Path) -> Findings:
    """Set liquid between plates in motion."""
    from reflowshock.particles.scenes.viscous_flows import solve_poiseuille

    return _flow(run, folder, solve_poiseuille, CHANNEL_LIMITS)


def flow_taylor_green(run: Run[TaylorGreenCase], folder: Path) -> Findings:
    """Let vortices die out."""
    from reflowshock.particles.scenes.viscous_flows import solve_taylor_green

    return _flow(run, folder, solve_taylor_green, VORTEX_LIMITS)


def _flow(run: Run[Any], folder: Path, solve: Callable, limits: Mapping[str, float]) -> Findings:
    """Let a scene flow, write what it became, judge it."""
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.scenes.products import write_flow

    case: FlowCase = run.case
    checkpoint = Checkpoint(run.checkpoints("particles") / case.kind, (case.scene,))
    with progress_bar(f"flow of {case.scene.particles} particles") as progress:
        result = solve(case.scene, progress, checkpoint)
    write_flow(folder, result)
    known = {name: metric(value, unit) for name, (value, unit) in result.metrics.items() if value == value}
    known |= {name: metric(word, "") for name, word in result.words.items()}
    health = {name: at_most(abs(result.metrics[name][0]), limit) for name, limit in limits.items()}
    found = Findings(known, health, dict(decide_flow(case.scene)))
    return replace(found, continued="the flow" if checkpoint.continued else "")
