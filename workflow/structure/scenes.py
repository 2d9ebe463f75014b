"""3D scenes of a structure: deformation and natural modes."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from reflowshock.workflow.report.bodies import LAYER_COLOURS, body_group, exaggeration, milliseconds
from reflowshock.workflow.report.field_series import FieldSeries
from reflowshock.workflow.report.scene import Field, Group, Scene

MEGA, MILLI, MICRO = 1e6, 1e-3, 1e-6
STRESS = "von Mises stress"


def deformation_scene(models: Sequence[Path], parts: Sequence[str], time: float) -> Scene:
    """Return a scene with the models of a structure at all stored times, starting at the one nearest to a time [s].

    Args:
        models: PVD files of the models, one for each.
        parts: Names of the layers, in the order of their numbers in the files.
        time: Time of the frame that is shown first [s].

    Returns:
        Interactive 3D scene for the report page.
    """
    series = FieldSeries.read(models, ("part", "von_mises"), time)
    groups = _layers(series, parts, {STRESS: series.fields["von_mises"] / MEGA})
    size = float(np.linalg.norm(series.displacement, axis=2).max())
    unit, factor = ("mm", 1.0 / MILLI) if size > 0.01 * MILLI else ("µm", 1.0 / MICRO)
    stress = max(float(group.values[STRESS].max()) for group in groups)
    fields = [Field("displacement", unit, 0.0, size * factor, source="length", factor=factor)]
    return Scene(
        groups,
        parts,
        [*fields, Field(STRESS, "MPa", 0.0, stress)],
        milliseconds(series.times),
        start=series.nearest(time),
        exaggeration=exaggeration(_extent(series), size),
    )


def modes_scene(path: Path, parts: Sequence[str], modes: Sequence[Mapping]) -> Scene:
    """Return a scene with one natural mode per frame.

    Args:
        path: PVD file of the modes.
        parts: Names of the layers, in the order of their numbers in the file.
        modes: Records with ``mode`` (number) and ``frequency`` [Hz], see ``read_modes``.

    Returns:
        Interactive 3D scene for the report page.
    """
    series = FieldSeries.read([path], ("part",))
    size = float(np.linalg.norm(series.displacement, axis=2).max()) or 1.0
    frames = [f"mode {mode['mode']}: {mode['frequency']:.1f} Hz" for mode in modes[: len(series.times)]]
    field = Field("displacement", "of the largest", 0.0, 1.0, source="length", factor=1.0 / size)
    return Scene(_layers(series, parts, {}), parts, [field], frames)


def _layers(series: FieldSeries, parts: Sequence[str], values: Mapping[str, np.ndarray]) -> list[Group]:
    """Return each layer of a structure as a group."""
    part = series.fields["part"][0].astype(int)
    groups = []
    for number, name in enumerate(parts):
        if (part == number).any():
            colour = LAYER_COLOURS[number % len(LAYER_COLOURS)]
            groups.append(body_group(name, series, part == number, values, colour=colour))
    return groups


def _extent(series: FieldSeries) -> float:
    return float(np.ptp(series.points, axis=0).max())
