"""Speed of this machine: measured time of an element update of explicit steps over that of the reference machine.

``python -m reflowshock.fem.run.calibrate`` prints it as JSON. Forecasts multiply the times of the reference machine by
the slowness, which the program measures once per machine (``workflow/process/machine_speed.py``).
"""

import json
from itertools import product

import numpy as np

from reflowshock.fem.coupling.speeds import Kind, sample_terms, seconds_of_step
from reflowshock.fem.estimates.solver_cost import NONLINEAR_RATE, TURNING_BOX_RATE, TURNING_RATE
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.materials.library import LIBRARY

FORMULATION = "incompatible_modes"
CELLS, EDGE, SKEW = 16, 5e-4, 0.1  # cells along an edge of the sample, their size [m], displacement over size
STEP = 1e-8  # [s]; the nodes stay at rest
ROUNDS = 5  # so that each family is timed at several moments, of which the least disturbed one counts
# Family -> material, displacement of the nodes over the size of a cell, and rate of the reference machine [1/s]
FAMILIES = {
    "turning_box": ("FR4", 0.0, TURNING_BOX_RATE),
    "turning": ("FR4", SKEW, TURNING_RATE),
    "path": ("SAC405", SKEW, NONLINEAR_RATE[FORMULATION]),
}


def slowness() -> dict[str, float]:
    """Measure the time of an element update on this machine over the time on the reference machine; takes seconds.

    Returns:
        Element family -> ratio, above one on a slower machine, with the families ``turning_box`` (corotational boxes),
        ``turning`` (other corotational hexahedra) and ``path`` (path-dependent elements).
    """
    rounds = [
        {family: _seconds(material, skew) * rate for family, (material, skew, rate) in FAMILIES.items()}
        for _ in range(ROUNDS)
    ]
    return {family: min(times[family] for times in rounds) for family in FAMILIES}


def _seconds(material: str, skew: float) -> float:
    """Return the time of an element update [s] of a cube of cells, whose nodes a skew moves."""
    cube = _cube(skew)
    kind = Kind((LIBRARY[material],), FORMULATION, "corotational", STEP)
    return seconds_of_step(sample_terms(cube, kind), len(cube.points)) / len(cube.cells)


def _cube(skew: float) -> MeshData:
    """Return a cube of hexahedra whose nodes are moved at random by up to a share of the size of a cell."""
    side = np.arange(CELLS + 1)
    points = EDGE * np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    points += skew * EDGE * np.random.default_rng(0).uniform(-1.0, 1.0, points.shape)
    strides = np.array([(CELLS + 1) ** 2, CELLS + 1, 1])
    corners = np.array(list(product((0, 1), repeat=3)))[:, ::-1] @ strides  # tensor order: x fastest
    first = np.stack(np.meshgrid(*[side[:-1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3) @ strides
    cells = (first[:, None] + corners).astype(np.int32)
    return MeshData(points, cells, np.zeros(len(cells), np.int32), ("sample",), {})


if __name__ == "__main__":
    print(json.dumps(slowness()))
