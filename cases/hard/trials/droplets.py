"""Trials of delta-SPH: droplets, tanks and printed parts, checked by energy, momentum, volume and exact shapes."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from reflowshock.arrays import Floats
from reflowshock.cases.hard.trial import Trial, pure_trial
from reflowshock.parameters import Parameters, with_value
from reflowshock.particles.flows.dam_break import DamBreak
from reflowshock.particles.flows.droplet import Droplet, cap
from reflowshock.particles.flows.flow_effects import sph_sound
from reflowshock.particles.flows.printing import Printing
from reflowshock.quantity import Quantity

if TYPE_CHECKING:
    from reflowshock.particles.sph.fluid_state import Fields
    from reflowshock.particles.sph.simulation import Simulation

# Steps between samples of energy, momentum and other measures.
LOOK = 10
# Distance outside the surface, in spacings, beyond which a particle counts as lost.
OUTSIDE = 1.0
# Shares of the duration: end of the initial phase, and begin of the means "at rest".
LATE, EARLY = 0.9, 0.1


class Unrest(Parameters):
    """Random disorder of the particles at the start.

    ``displaced`` is the largest displacement along each axis over the spacing; ``density`` the largest relative change
    of density. Both are uniform from a seed.
    """

    displaced: float = Field(0.0, ge=0, le=0.3)
    density: float = Field(0.0, ge=0, le=0.05)
    seed: int = Field(1, ge=0)

    def disturb(self, fields: "Fields", fluids: int, spacing: float) -> None:
        """Displace the particles of a liquid, a spacing [m] apart, and change their densities."""
        random = np.random.default_rng(self.seed)
        for coordinate in fields[:3]:
            if np.ptp(coordinate) > 0.0:
                coordinate[:fluids] += self.displaced * spacing * random.uniform(-1.0, 1.0, fluids)
        fields.density[:fluids] *= 1.0 + self.density * random.uniform(-1.0, 1.0, fluids)


class DropletTrial(Parameters):
    """One droplet or two equal ones for the duration of the scene.

    The second droplet lands next to the first, or they collide along x with a speed each and paths an offset apart
    [diameters].
    """

    droplet: Droplet
    pair: Literal["none", "beside", "against"] = "none"
    approach: Annotated[float, Quantity("m/s")] = Field(0.0, ge=0)
    offset: float = Field(0.0, ge=0, le=1)
    unrest: Unrest = Unrest()


class TankTrial(Parameters):
    """Plane column of liquid in a tank, at rest at one wall or thrown at the other from the middle.

    With ``undiffused`` it runs again without density diffusion to compare the noise.
    """

    dam_break: DamBreak
    thrown: Annotated[float, Quantity("m/s")] = Field(0.0, ge=0)
    unrest: Unrest = Unrest()
    undiffused: bool = False

    @model_validator(mode="after")
    def _fits(self) -> "TankTrial":
        if self.dam_break.width > self.dam_break.tank_length:
            raise ValueError("the column is wider than the tank")
        return self


class PrintTrial(Parameters):
    """Printed drops."""

    printing: Printing


@dataclass(slots=True)
class Watch:
    """Sampler of a moving liquid, called in every step."""

    simulation: "Simulation"
    rows: list[tuple[float, ...]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._look()

    def __call__(self, fraction: float) -> None:
        """Take a sample when one is due."""
        if self.simulation.steps % LOOK == 0 or fraction >= 1.0:
            self._look()

    def _look(self) -> None:
        simulation = self.simulation
        fields, liquid = simulation.fields, slice(simulation.fluids)
        mass, law = fields.mass[liquid], simulation.law
        weight = -law.gravity_z * float(mass @ fields.z[liquid])
        tension = simulation.surface.energy if simulation.surface else 0.0
        momentum = [float(mass @ speed[liquid]) for speed in fields[3:6]]
        centre = [float(mass @ coordinate[liquid]) / float(mass.sum()) for coordinate in fields[:3]]
        self.rows.append(
            (
                simulation.time, simulation.kinetic_energy + tension + weight + simulation.elastic_energy,
                simulation.fastest,
                float(np.hypot(momentum[0], momentum[1])) if law.mirror else float(np.linalg.norm(momentum)),
                float(np.abs(fields.density[liquid] / law.rest_density - 1.0).max()),
                float(simulation.pressures.mean()), *centre,
            )
        )  # fmt: skip

    def measured(self) -> dict[str, float]:
        """Return the measures of all liquids."""
        time, energy, fastest, momentum, squeezed, pressure, *centre = np.array(self.rows).T
        law, mass = self.simulation.law, float(self.simulation.fields.mass[: self.simulation.fluids].sum())
        later = np.maximum.accumulate(energy[::-1])[::-1]
        early, late = (time >= share * time[-1] for share in (EARLY, LATE))
        middle = early & (time <= 2.0 * EARLY * time[-1])
        aside = np.hypot(*(coordinate - coordinate[early][0] for coordinate in centre[:2]))
        return {
            "steps": self.simulation.steps,
            "energy_over_start": energy.max() / energy[0] - 1.0,
            "energy_rise": (later - energy).max() / abs(energy[0]),
            "mach": fastest.max() / law.sound,
            "density_change": squeezed.max(),
            "momentum": np.abs(momentum - momentum[0]).max() / (mass * fastest.max()) if fastest.max() else 0.0,
            "speed_growth": fastest[late].mean() / fastest[middle].mean(),
            "pressure_drift": pressure[late].mean() / pressure[middle].mean() - 1.0,
            "drift_aside": aside[early].max() / law.spacing,
            "volume_drift": self.simulation.volume / (self.simulation.fluids * law.spacing**law.dimension) - 1.0,
        }


def droplet(parameters: DropletTrial) -> dict[str, float]:
    """Run one droplet or two."""
    from reflowshock.particles.sph_flows.droplet import follow

    scene, simulation = parameters.droplet, droplets(parameters)
    watch, count = Watch(simulation), 1 + (parameters.pair != "none")
    result = follow(scene, simulation, watch)
    shapes = _shape(parameters, result.history, result.metrics)
    surface = simulation.surface
    assert surface is not None
    return watch.measured() | shapes | {
        "followed": simulation.time / scene.unit_of_time,
        "surface_volume": (surface.volume + surface.spray) / (count * scene.volume) - 1.0,
        "outside": _outside(simulation),
        "below_wall": float((simulation.fields.z < 0.0).sum()) if scene.has_wall else 0.0,
        "mergers": sum(merger.after < merger.before for merger in surface.topology_changes),
    }  # fmt: skip


def droplets(parameters: DropletTrial) -> "Simulation":
    """Set up one droplet or two with their disorder."""
    from reflowshock.particles.sph import flow
    from reflowshock.particles.sph.simulation import Simulation
    from reflowshock.particles.sph_flows.droplet import droplet as alone
    from reflowshock.particles.surface.remeshing import EDGE

    scene = parameters.droplet
    simulation = alone(scene)
    fields, surface = simulation.fields, simulation.surface
    assert surface is not None
    if parameters.pair != "none":
        points, corners, triangles = np.array(fields[:3]), surface.points.copy(), surface.triangles.copy()
        gap = 0.5 * EDGE * simulation.law.spacing
        aside = np.array([0.5 * (np.ptp(corners[:, 0])) + gap, 0.5 * parameters.offset * scene.diameter, 0.0])
        both = np.concatenate((points - aside[:, None], points + aside[:, None]), axis=1)
        fields = flow.make_fields(both, np.empty((3, 0)), np.zeros(both.shape[1]), simulation.law)
        fields.u[:] = parameters.approach * np.repeat([1.0, -1.0], points.shape[1])
        fields.w[:] = -scene.impact_speed
        surface.mesh.points = corners - aside
        surface.add(corners + aside, triangles)
    parameters.unrest.disturb(fields, len(fields.x), simulation.law.spacing)
    return Simulation(fields, len(fields.x), simulation.law, surface, flow.device_of(scene))


def _shape(parameters: DropletTrial, history: dict[str, Floats], metrics: dict[str, Any]) -> dict[str, float]:
    """Return errors of the rest shape of the whole liquid, and the spread of an impact."""
    scene, late = parameters.droplet, history["time"] >= LATE * history["time"][-1]
    mean = {name: float(column[late].mean()) for name, column in history.items()}
    size = 1.0 if parameters.pair == "none" else 2.0 ** (1.0 / 3.0)
    measures = {
        "capillary_number": metrics["capillary_number"][0],
        "parts": history["parts"][-1],
        "spread_max": history["spread"].max(),
    }
    if not scene.has_wall:
        pressure = mean["mean_pressure"] / scene.laplace_pressure * size - 1.0
        return measures | {"pressure_error": pressure, "roundness": mean["roundness"]}
    base, height = cap(scene.angle)
    errors = {"base_error": mean["base"] / (size * base) - 1.0, "height_error": mean["height"] / (size * height) - 1.0}
    return measures | errors


def _outside(simulation: "Simulation") -> float:
    """Return the share of particles more than ``OUTSIDE`` outside their surface."""
    from reflowshock.particles.surface.cloud_level_set import with_mirror_image
    from reflowshock.particles.surface.level_set import measure_depths

    surface = simulation.surface
    assert surface is not None
    closed = surface.points, surface.triangles
    closed = with_mirror_image(*closed) if simulation.law.mirror else closed
    inside = measure_depths(np.stack(simulation.fields[:3], axis=1), *closed)
    return float((inside < -OUTSIDE * simulation.law.spacing).mean())


def tank(parameters: TankTrial) -> dict[str, float]:
    """Run a column in a tank; noise is the deviation from hydrostatic pressure over rho g H."""
    measures, noise = _tank(parameters)
    if parameters.undiffused:
        rough = with_value(parameters, "dam_break.numerics.density_diffusion", 0.0)
        measures["noise_gain"] = _tank(rough)[1] / noise
    return measures


def _tank(parameters: TankTrial) -> tuple[dict[str, float], float]:
    from reflowshock.particles.sph import flow
    from reflowshock.particles.sph.simulation import Simulation
    from reflowshock.particles.sph_flows.dam_break import dam, particles_lost

    scene = parameters.dam_break
    filled = dam(scene)
    if parameters.thrown:
        filled.fields.u[: filled.fluids] = parameters.thrown
        filled.fields.x[: filled.fluids] += 0.5 * (scene.tank_length - scene.width)
    parameters.unrest.disturb(filled.fields, filled.fluids, filled.law.spacing)
    simulation = Simulation(filled.fields, filled.fluids, filled.law, device=flow.device_of(scene))
    watch, unit = Watch(simulation), scene.density * scene.gravity * scene.height

    def errors(now: "Simulation") -> tuple[float, float, float]:
        error = now.pressures / unit - 1.0 + now.fields.z[: now.fluids] / scene.height
        return now.time, float(error.mean()), float(error.std())

    history = flow.run_flow(simulation, scene.until, errors, watch).history(("time", "mean", "noise"))
    late = history["time"] >= LATE * history["time"][-1]
    noise = float(history["noise"][late].mean())
    measures = {
        "noise": noise,
        "pressure_error": history["mean"][late].mean(),
        "particles_lost": particles_lost(scene, simulation),
        "speed_at_end": np.array(watch.rows)[-1, 2] / scene.fastest,
    }
    return watch.measured() | measures, noise


def printed(parameters: PrintTrial) -> dict[str, float]:
    """Print a part; return speeds over the speed of sound and lengths over the drop diameter or the spacing."""
    from scipy.spatial import cKDTree

    from reflowshock.particles.printing.printing import solve_printing

    scene = parameters.printing
    result, part = solve_printing(scene)
    points = result.pictures[-1].points
    nearest = cKDTree(points).query(points, k=2)[0][:, 1]
    names = ("volume_error", "volume_drift", "connected_parts_max", "mergers", "splits", "voids", "steps")
    return {
        **{name: result.metrics[name][0] for name in names},
        "mach": result.history["largest_speed"].max() / sph_sound(scene),
        "closest": nearest.min() / scene.spacing,
        "farthest": nearest.max() / scene.spacing,
        "below_wall": float((points[:, 2] < 0.0).sum()),
        "height": part.heights.max() / scene.length,
    }


MOTION = (
    "steps energy_over_start energy_rise mach density_change momentum speed_growth pressure_drift drift_aside "
    "volume_drift"
)
SHAPES = (
    "followed surface_volume outside below_wall mergers capillary_number parts spread_max pressure_error roundness "
    "base_error height_error"
)
PRINTED = (
    "volume_error volume_drift connected_parts_max mergers splits voids steps mach closest farthest below_wall height"
)
TRIALS: dict[str, Trial] = {
    "droplet": pure_trial(DropletTrial, "droplets:droplet", f"{MOTION} {SHAPES}"),
    "tank": pure_trial(
        TankTrial, "droplets:tank", f"{MOTION} noise pressure_error particles_lost speed_at_end noise_gain"
    ),
    "print": pure_trial(PrintTrial, "droplets:printed", PRINTED),
}
