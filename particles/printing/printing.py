"""Printing run: drops land one after the other, flow and solidify into the printed part.

Time advances by events. Moving liquid is computed in time steps. Once the settling time has passed since the last drop
landed, or the liquid no longer moves, time jumps to the next landing or curing particle. Freezing drops are computed
until they are solid.
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
from reflowshock.particles.flows.printing import Printing
from reflowshock.particles.flows.result import FlowResult, Metrics, Picture
from reflowshock.particles.printing.deposit import LIQUID, Deposit
from reflowshock.particles.printing.part import Part, measure_part, part_of
from reflowshock.particles.sph.flow import PICTURES
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.surface.morphological_closing import TopologyChange
from reflowshock.particles.surface.surface_mesh import SurfaceLost

COLUMNS = ("time", "drops", "largest_speed", "kinetic_energy", "surface_energy", "height")
# Number of steps between two exposures to light, and between two rows of the history.
LIGHT, SAMPLE = 20, 20
# Kinetic energy over the surface energy of one sphere below which liquid is at rest.
REST = 1e-4


@dataclass(slots=True)
class PrintRun:
    """State of a printing run.

    Attributes:
        deposit: Ink on the plate.
        landed: Number of drops that have landed.
        since: Time at which the last drop landed [s].
        followed: Time that was simulated since the last exposure to light [s].
        steps: Number of time steps.
        particle_steps: Number of liquid particles, summed over the steps.
        left: Largest kinetic energy that liquid had when it was taken to rest, over the surface energy of a sphere.
        rows: Rows of the history.
        pictures: Particles after some of the drops.
        seconds: Wall time [s].
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
        """Return the state, for a checkpoint."""
        return {
            "deposit": self.deposit.saved(), "rows": np.array(self.rows), "pictures": self.pictures,
            "numbers": {name: getattr(self, name) for name in NUMBERS},
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        self.deposit.restore(saved["deposit"])
        self.rows, self.pictures = [tuple(row) for row in saved["rows"].tolist()], saved["pictures"]
        for name, value in saved["numbers"].items():
            setattr(self, name, value)


NUMBERS = ("landed", "since", "followed", "steps", "particle_steps", "left", "seconds")


def solve_printing(
    scene: Printing, progress: Callable[[float], None] | None = None, checkpoint: Checkpoint | None = None
) -> tuple[FlowResult, Part]:
    """Simulate the printing of a part, drop by drop, and measure it.

    The metric ``spray_share`` is the largest share of the liquid present at one time that was outside its surface, so
    it also detects one drop that splashes among many.

    Args:
        scene: Parameters of the print: drops, their positions and order, ink, curing and numerics.
        progress: Function called with the fraction of drops that are solid, 0 to 1.
        checkpoint: Checkpoint to continue from, if its file exists, and to write.

    Returns:
        History, pictures and metrics of the run, and the printed part.

    Raises:
        FloatingPointError: A position is not finite.
        SurfaceLost: The liquid has left its surface, or the triangles no longer form a surface.
    """
    run = PrintRun(Deposit(scene))
    saved = checkpoint.read((Picture, TopologyChange)) if checkpoint else None
    if saved:
        run.restore(saved)
    while run.landed < scene.drops or run.deposit.simulation:
        start = perf_counter()
        try:
            with threads_for(run.deposit.moving):
                _advance(run, scene)
        except SurfaceLost as error:
            raise SurfaceLost(
                f"drop {run.landed}, {1e6 * run.deposit.time:.4g} us: {error}; increase particles_per_diameter"
            ) from error
        run.seconds += perf_counter() - start
        if checkpoint is not None and checkpoint.is_due():
            checkpoint.write(run.saved())
        if progress is not None:
            progress((run.landed - (run.deposit.simulation is not None)) / scene.drops)
    return _result(run, scene)


def _advance(run: PrintRun, scene: Printing) -> None:
    """Advance by one time step if liquid moves, otherwise to the next event."""
    deposit = run.deposit
    arrival = run.landed * scene.delay if run.landed < scene.drops else inf
    if deposit.time >= arrival:
        _expose(run)
        places = scene.places()
        deposit.add_drop(places[run.landed % len(places)])
        run.landed, run.since = run.landed + 1, deposit.time
        _sample(run)
    elif deposit.simulation is None:
        deposit.time = arrival
    elif _rests(run, deposit.simulation, scene):
        _expose(run)
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
            _expose(run)
        if run.steps % SAMPLE == 0:
            _sample(run)


def _expose(run: PrintRun) -> None:
    """Expose the ink to the light of the simulated time and cure it."""
    run.deposit.expose(run.followed)
    run.followed = 0.0
    run.deposit.cure()


def _rests(run: PrintRun, simulation: Simulation, scene: Printing) -> bool:
    """Return whether the liquid may be taken to rest."""
    if scene.freezes:
        return False
    is_old = run.deposit.time - run.since >= scene.settling_time
    return is_old or simulation.kinetic_energy < REST * _unit_of_energy(scene)


def _unit_of_energy(scene: Printing) -> float:
    """Return the surface energy of one spherical drop [J]."""
    return pi * scene.length**2 * scene.surface_tension


def _sample(run: PrintRun) -> None:
    """Add a row to the history."""
    deposit = run.deposit
    if deposit.simulation is None:
        return
    top = max([float(deposit.surface.points[:, 2].max()), *(float(body.points[:, 2].max()) for body in deposit.bodies)])
    fastest, kinetic = deposit.simulation.fastest, deposit.simulation.kinetic_energy
    run.rows.append((deposit.time, float(run.landed), fastest, kinetic, deposit.surface.energy, top))


def _picture(run: PrintRun, scene: Printing) -> None:
    """Store the present particles, after about ``PICTURES`` of the drops."""
    deposit, count = run.deposit, len(run.pictures)
    if run.landed * PICTURES < (count + 1) * scene.drops or count >= min(run.landed, PICTURES):
        return
    deposit.update()
    velocity = np.stack(deposit.fields[3:6], axis=1)
    velocity[deposit.state != LIQUID] = 0.0
    run.pictures.append(Picture(deposit.time, deposit.points, velocity, deposit.pressures))


def _result(run: PrintRun, scene: Printing) -> tuple[FlowResult, Part]:
    """Return the result of the run and the printed part."""
    deposit = run.deposit
    if not run.pictures or len(run.pictures[-1].points) < len(deposit.points):
        still = np.zeros_like(deposit.points)
        run.pictures.append(Picture(deposit.time, deposit.points, still, deposit.pressures))
    part = part_of(scene, deposit)
    history: dict[str, Floats] = dict(zip(COLUMNS, np.array(run.rows).T, strict=True))
    changes = deposit.surface.topology_changes
    metrics: Metrics = measure_part(scene, deposit, part) | {
        "mergers": (float(sum(change.after < change.before for change in changes)), ""),
        "splits": (float(sum(change.after > change.before for change in changes)), ""),
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
