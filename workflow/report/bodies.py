"""Surfaces of the cells of a run, with their fields, as groups of a 3D scene."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.workflow.report.field_series import FieldSeries
from reflowshock.workflow.report.scene import Group, boundary

SHARE = 0.12  # drawn displacement, as a share of the body's size
COLOURS = {
    "solder": "#98a2af", "copper": "#b5622d", "board": "#62a876", "substrate": "#c2971c", "die": "#56626e",
    "other packages": "#7a5ea8",
}  # fmt: skip
LAYER_COLOURS = ("#62a876", "#c2971c", "#56626e", "#b5622d", "#98a2af", "#7a5ea8")


def body_group(
    name: str, series: FieldSeries, chosen: NDArray[np.bool_], values: Mapping[str, Floats], **style: Any
) -> Group:
    """Return the surface of selected cells of a run.

    Args:
        name: Name of the group.
        series: Cells, displacements at k times and parts (``fields["part"]``) of the run.
        chosen: Mask of the selected cells, shape (c,).
        values: Cell values of each field, shape (k, c); a vertex gets the mean over its faces.
        style: Further attributes of ``Group``, such as ``colour``.

    Returns:
        Vertices, faces, displacements and values of the fields at the k times, as one group of a scene.
    """
    faces, cell = boundary(series.cells[chosen])
    part = series.fields["part"][0][chosen].astype(np.int64)[cell]
    span = len(series.points)
    keys, vertices = np.unique(part[:, None] * span + faces, return_inverse=True)
    vertices = vertices.reshape(faces.shape)
    nodes = keys % span
    return Group(
        name,
        series.points[nodes],
        vertices,
        keys // span,
        displacement=series.displacement[:, nodes],
        values={
            key: _at_vertices(of_cells[:, chosen][:, cell], vertices, len(keys)) for key, of_cells in values.items()
        },
        **({"colour": COLOURS.get(name, LAYER_COLOURS[0])} | style),
    )


def _at_vertices(values: Floats, faces: NDArray[np.int64], count: int) -> Floats:
    """Return the mean of face values, shape (k, f), at each vertex, shape (k, count)."""
    weight = np.bincount(faces.ravel(), minlength=count)
    repeated = (np.repeat(row, faces.shape[1]) for row in values)
    return np.array([np.bincount(faces.ravel(), row, count) for row in repeated]) / weight


def exaggeration(length: float, deflection: float) -> float:
    """Return the factor by which displacements are enlarged in a picture; 1 for a body at rest.

    Args:
        length: Size of the body [m].
        deflection: Largest displacement [m].
    """
    return max(round_down(SHARE * length / deflection), 1.0) if deflection > 0.0 else 1.0


def round_down(factor: float) -> float:
    """Round a positive number down to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(factor))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= factor))


def milliseconds(times: Floats) -> list[str]:
    """Return times as labels of frames, in milliseconds.

    Args:
        times: Times, shape (k,) [s].
    """
    return [f"{1e3 * time:.4g} ms" for time in times]
