"""3D scene of liquid solder: particles and free surface at the stored times and at the end."""

from typing import TYPE_CHECKING

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.workflow.report.scene import Field, Group, Scene

if TYPE_CHECKING:
    from reflowshock.particles.steps.shape import JointShape

SMALLEST_RANGE = 0.01  # of the colour scale, relative to the mean
PRESSURE = "pressure above ambient"
NO_FACES = np.zeros((0, 3), dtype=int)


def particle_scene(shape: "JointShape") -> Scene:
    """Return the scene of a solder body: the stored states, then the final state coloured by pressure.

    Args:
        shape: Result of a reflow: particles, free surface and history of one solder body.

    Returns:
        Interactive 3D scene for the report page.
    """
    states = [*((state.points, state.triangles) for state in shape.snapshots[:-1]), (shape.points, shape.triangles)]
    frames = [f"{1e3 * state.time:.4g} ms" for state in shape.snapshots[:-1]] + ["end"]
    size = 0.8 * float(np.cbrt(np.prod(np.ptp(shape.points, axis=0)) / len(shape.points)))
    groups = []
    for frame, (points, triangles) in enumerate(states):
        values = {PRESSURE: shape.pressure[None]} if frame == len(states) - 1 else {}
        part = np.zeros(len(points), dtype=int)
        surface = points[: triangles.max(initial=-1) + 1]
        groups.append(Group("particles", points, NO_FACES, part, "#8a949e", values=values, only=frame, size=size))
        groups.append(
            Group("free surface", surface, triangles, part[: len(surface)] + 1, "#5f86ad", is_ghost=True, only=frame)
        )
    low, high = _limits(shape.pressure)
    field = Field(PRESSURE, "Pa", low, high)
    return Scene(groups, ["particle", "free surface"], [field], frames, start=len(states) - 1, view=(-0.3, -1.8, 0.6))


def _limits(pressure: Floats) -> tuple[float, float]:
    """Return the limits of the colour scale, at least 1 % around the mean so that equal values look equal."""
    mean = float(pressure.mean())
    low, high = float(pressure.min()), float(pressure.max())
    return min(low, mean - SMALLEST_RANGE * abs(mean)), max(high, mean + SMALLEST_RANGE * abs(mean))
