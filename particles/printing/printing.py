"""Drop after drop lands, flows and cures: from the first one to the printed part.

Time goes on in events. While liquid moves it is computed step by step; what has been followed for the settling time
since the last drop landed, or does not move any more, rests until the next drop lands or a particle cures: no steps.
What freezes is followed until it is solid.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf, pi
from time import perf_counter
from typing import Any

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.threads import threads_for
from reflowshock.particles.parameters.printing import Printing
from reflowshock.particles.printing.deposit import LIQUID, Deposit
from reflowshock.particles.printing.part import Part, measure_part, part_of
from reflowshock.particles.sph.flow import PICTURES, FlowResult, Metrics, Picture
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.surface.morphological_closing import TopologyChange
from reflowshock.particles.surface.surface_mesh import SurfaceLost

COLUMNS = ("time", "drops", "largest_speed", "kinetic_energy", "surface_energy", "height")
# Steps after which the light is accounted for, and after which a row of the history is kept.
LIGHT, SAMPLE = 20, 20
# Kinetic energy over the surface energy of one sphere below which liquid is at rest.
REST = 1e-4


@dataclass(slots=True)
class PrintRun:
    """State of a run.

    Attributes:
        deposit: the ink.
        landed: drops that have.
        since: time of the last one [s].
        followed: time for which liquid was followed that has got no light yet [s].
        steps: of all liquid together.
        particle_steps: liquid particles, summed over the steps.
        left: largest kinetic energy of liquid that was taken to rest, over the surface energy of a sphere.
        rows: of the history.
        pictures: after a drop each.
        seconds: wall time [s].
    """

    deposit: Deposit
    landed: int = 0
    since: float = 0.0
    followed: float = 0.0
    steps: int = 0
    particle_steps: int = 0
    left: float = 0.0
    rows: list[tuple[float, ...]] = field(default_factory=list)
    pictures: list[Picture] = field(default_factory=list)
    seconds: float = 0.0

    def saved(self) -> dict[str, Any]:
        """All of it, for a checkpoint."""
        return {
            "deposit": self.deposit.saved(), "rows": np.array(self.rows), "pictures": self.pictures,
            "numbers": {name: getattr(self, name) for name in NUMBERS},
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        self.deposit.restore(saved["deposit"])
        self.rows, self.pictures = [tuple(row) for row in saved["rows"].tolist()], saved["pictures"]
        for name, value in saved["numbers"].items():
            setattr(self, name, value)


NUMBERS = ("landed", "since", "followed", "steps", "particle_steps", "left", "seconds")


def solve_printing(
    scene: Printing, progress: Callable[[float], None] | None = None, checkpoint: Checkpoint | None = None
) -> tuple[FlowResult, Part]:
    """Print a part.

    Its metric `spray_share` is the largest share of the liquid of a time, not of all that is printed, that was outside
    its surface: so it tells of one drop that splashes among many.

    Raises:
        FloatingPointError: a position is not finite.
        SurfaceLost: the liquid has left its surface, or that is none any more.
    """
    run = PrintRun(Deposit(scene))
    saved = checkpoint.read((Picture, TopologyChange)) if checkpoint else None
    if saved:
        run.restore(saved)
    while run.landed < scene.drops or run.deposit.simulation:
        start = perf_counter()
        try:
            with threads_for(run.deposit.moving):
                _go_on(run, scene)
        except SurfaceLost as error:
            raise SurfaceLost(
                f"drop {run.landed}, {1e6 * run.deposit.time:.4g} us: {error}; take more particles per diameter"
            ) from error
        run.seconds += perf_counter() - start
        if checkpoint is not None and checkpoint.is_due():
            checkpoint.write(run.saved())
        if progress is not None:
            progress((run.landed - (run.deposit.simulation is not None)) / scene.drops)
    return _result(run, scene)


def _go_on(run: PrintRun, scene: Printing) -> None:
    """Go on to the next event, or by one step where liquid moves."""
    deposit = run.deposit
    arrival = run.landed * scene.delay if run.landed < scene.drops else inf
    if deposit.time >= arrival:
        _shine(run)
        places = scene.places()
        deposit.add_drop(places[run.landed % len(places)])
        run.landed, run.since = run.landed + 1, deposit.time
        _sample(run)
    elif deposit.simulation is None:
        deposit.time = arrival
    elif _rests(run, deposit.simulation, scene):
        _shine(run)
        if deposit.simulation is None:
            return
        run.left = max(run.left, deposit.simulation.kinetic_energy / _unit_of_energy(scene))
        _picture(run, scene)
        pause = min(arrival - deposit.time, deposit.cures_in())
        deposit.expose(pause)
        deposit.time = arrival if pause == arrival - deposit.time else deposit.time + pause
        deposit.cure()
    else:
        run.followed += deposit.step(arrival - deposit.time)
        run.steps, run.particle_steps = run.steps + 1, run.particle_steps + deposit.simulation.fluids
        if run.steps % LIGHT == 0:
            _shine(run)
        if run.steps % SAMPLE == 0:
            _sample(run)


def _shine(run: PrintRun) -> None:
    """Account for the light of the time in which liquid was followed."""
    run.deposit.expose(run.followed)
    run.followed = 0.0
    run.deposit.cure()


def _rests(run: PrintRun, simulation: Simulation, scene: Printing) -> bool:
    if scene.freezes:
        return False
    is_old = run.deposit.time - run.since >= scene.settling_time
    return is_old or simulation.kinetic_energy < REST * _unit_of_energy(scene)


def _unit_of_energy(scene: Printing) -> float:
    """Energy of the surface of one sphere [J]."""
    return pi * scene.length**2 * scene.surface_tension


def _sample(run: PrintRun) -> None:
    deposit = run.deposit
    if deposit.simulation is None:
        return
    top = max([float(deposit.surface.points[:, 2].max()), *(float(body.points[:, 2].max()) for body in deposit.bodies)])
    fastest, kinetic = deposit.simulation.fastest, deposit.simulation.kinetic_energy
    run.rows.append((deposit.time, float(run.landed), fastest, kinetic, deposit.surface.energy, top))


def _picture(run: PrintRun, scene: Printing) -> None:
    """Keep the present particles after some 24 of the drops."""
    deposit, count = run.deposit, len(run.pictures)
    if run.landed * PICTURES < (count + 1) * scene.drops or count >= min(run.landed, PICTURES):
        return
    deposit.update()
    velocity = np.stack(deposit.fields[3:6], axis=1)
    velocity[deposit.state != LIQUID] = 0.0
    run.pictures.append(Picture(deposit.time, deposit.points, velocity, deposit.pressures))


def _result(run: PrintRun, scene: Printing) -> tuple[FlowResult, Part]:
    """Return how the ink flowed, and what became of it."""
    deposit = run.deposit
    if not run.pictures or len(run.pictures[-1].points) < len(deposit.points):
        still = np.zeros_like(deposit.points)
        run.pictures.append(Picture(deposit.time, deposit.points, still, deposit.pressures))
    part = part_of(scene, deposit)
    history: dict[str, Floats] = dict(zip(COLUMNS, np.array(run.rows).T, strict=True))
    meetings = deposit.surface.topology_changes
    metrics: Metrics = measure_part(scene, deposit, part) | {
        "mergers": (float(sum(one.after < one.before for one in meetings)), ""),
        "splits": (float(sum(one.after > one.before for one in meetings)), ""),
        "spray_share": (deposit.spray, ""),
        "solid_after": (deposit.time - run.since, "s"),
        "motion_left": (run.left, ""),
        "weber": (scene.drop.weber_number, ""),
        "ohnesorge": (scene.drop.ohnesorge, ""),
        "particles": (float(len(deposit.points)), ""),
        "steps": (float(run.steps), ""),
        "particle_steps_per_second": (run.particle_steps / run.seconds, "1/s"),
        "seconds": (run.seconds, "s"),
    }
    return FlowResult(run.pictures, np.empty((0, 3)), history, metrics, {"outcome": part.outcome}), part
