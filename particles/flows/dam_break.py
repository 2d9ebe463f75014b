"""Dam break: a column of liquid collapses in the corner of a tank (Buchner 2002)."""

from math import sqrt
from typing import Annotated

import numpy as np
from pydantic import Field

from reflowshock.arrays import Floats
from reflowshock.particles.flows.flow import PlaneFlow
from reflowshock.particles.flows.lattice import lattice
from reflowshock.particles.flows.result import Metrics
from reflowshock.quantity import Quantity

# Sensor pressure, in rho g H, above which the wave counts as arrived.
REACHED = 0.05
# Time intervals in sqrt(H / g): the pressure plateau after the impact, and the second impact by the returning wave.
PLATEAU, SECOND = (3.5, 5.0), (5.2, 7.0)
# Width of the moving average that smooths the pressure before the second rise is located, in sqrt(H / g).
WINDOW = 0.1


class DamBreak(PlaneFlow):
    """Column of liquid released in the corner of a tank, with a pressure sensor in the opposite wall.

    The walls are smooth (free slip). Pressures are reported in rho g H and times in sqrt(H / g), where H is the height
    of the column.
    """

    has_free_surface = True

    height: Annotated[float, Quantity("m")] = Field(gt=0)
    width: Annotated[float, Quantity("m")] = Field(gt=0)
    tank_length: Annotated[float, Quantity("m")] = Field(gt=0)
    sensor_height: Annotated[float, Quantity("m")] = Field(gt=0)
    gravity: Annotated[float, Quantity("m/s^2")] = Field(9.81, gt=0)
    duration: Annotated[float, Quantity("s")] = Field(gt=0)

    @property
    def length(self) -> float:
        """Height of the column [m]."""
        return self.height

    @property
    def fastest(self) -> float:
        """Free-fall speed over the height of the column, sqrt(2 g H) [m/s]."""
        return sqrt(2.0 * self.gravity * self.height)

    @property
    def unit_of_time(self) -> float:
        """Time unit sqrt(H / g) [s]."""
        return sqrt(self.height / self.gravity)

    @property
    def columns(self) -> int:
        """Number of particles across the width of the column."""
        return max(1, round(self.width / self.spacing))

    @property
    def particles(self) -> int:
        """Number of liquid particles."""
        return self.columns * self.numerics.particles_across

    @property
    def until(self) -> float:
        """Duration of the flow [s]."""
        return self.duration


def column_points(scene: DamBreak) -> Floats:
    """Return the initial positions of the particles of the column, rows x, y, z of shape (3, n) [m].

    Args:
        scene: Size of the column and particle spacing; the lattice lies in the plane y = 0.
    """
    return lattice(np.arange(scene.columns), np.arange(scene.numerics.particles_across), scene.spacing)


def tank_points(scene: DamBreak, layers: int) -> Floats:
    """Return the positions of the wall particles of an open tank, rows x, y, z of shape (3, m) [m].

    The tank is four times as high as the column.

    Args:
        scene: Parameters of the dam break: column, tank, pressure sensor, liquid and numerics.
        layers: Number of particle layers in each wall.
    """
    spacing, length = scene.spacing, tank_columns(scene)
    rows = np.arange(-layers, 4 * scene.numerics.particles_across)
    block = lattice(np.arange(-layers, length + layers), rows, spacing)
    outside = (block[0] < 0.0) | (block[0] > length * spacing) | (block[2] < 0.0)
    return block[:, outside]


def tank_columns(scene: DamBreak) -> int:
    """Return the length of the tank in particle spacings, rounded to an integer.

    Args:
        scene: Length of the tank and particle spacing.
    """
    return round(scene.tank_length / scene.spacing)


def dam_metrics(scene: DamBreak, history: dict[str, Floats]) -> Metrics:
    """Compute the metrics of a dam break.

    Args:
        scene: Parameters of the dam break: column, tank, pressure sensor, liquid and numerics.
        history: Samples over time, shape (n,), in the columns ``time`` [s], ``sensor_pressure`` [Pa],
            ``kinetic_energy``, ``potential_energy`` and ``elastic_energy``.

    Returns:
        Value and unit of ``impact_onset`` and ``second_rise`` in sqrt(H/g), ``plateau_mean`` in rho g H, and
        ``energy_rise``, the largest rise of the total energy over the initial one; nan for events after the end.
    """
    time = history["time"] / scene.unit_of_time
    pressure = history["sensor_pressure"] / (scene.density * scene.gravity * scene.height)
    reached = pressure > REACHED
    plateau = (time >= PLATEAU[0]) & (time <= PLATEAU[1])
    total = history["kinetic_energy"] + history["potential_energy"] + history["elastic_energy"]
    unknown = float("nan")
    return {
        "impact_onset": (float(time[np.argmax(reached)]) if reached.any() else unknown, "sqrt(H/g)"),
        "plateau_mean": (float(pressure[plateau].mean()) if time[-1] >= PLATEAU[1] else unknown, "rho g H"),
        "second_rise": (second_rise(time, pressure), "sqrt(H/g)"),
        "energy_rise": (float((np.maximum.accumulate(total[::-1])[::-1] - total).max() / total[0]), ""),
    }  # fmt: skip


def second_rise(time: Floats, pressure: Floats) -> float:
    """Return the time of the second pressure rise: halfway from the plateau to the largest smoothed pressure after it.

    Args:
        time: Times, shape (n,) [sqrt(H / g)].
        pressure: Pressure at the sensor, shape (n,) [rho g H].

    Returns:
        Time in sqrt(H / g); nan if the history ends before.
    """
    if time[-1] < SECOND[1]:
        return float("nan")
    width = max(1, round(WINDOW / float(np.diff(time).mean())))
    smooth = np.convolve(pressure, np.full(width, 1.0 / width), mode="same")
    plateau = pressure[(time >= PLATEAU[0]) & (time <= PLATEAU[1])].mean()
    later = (time >= SECOND[0]) & (time <= SECOND[1])
    middle = 0.5 * (plateau + smooth[later].max())
    return float(time[later][np.argmax(smooth[later] >= middle)])
