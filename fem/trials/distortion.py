"""Boxes of elements as bad as wanted: nodes moved at random until the least scaled Jacobian is a given one."""

import numpy as np
from scipy.optimize import brentq

from reflowshock.fem.elements.element import Elements
from reflowshock.fem.materials.parameters import Isotropic, Material, Orthotropic
from reflowshock.fem.mesh.mesh_quality import scaled_jacobians
from reflowshock.fem.trials.boxes import KINDS, box, elements_of
from reflowshock.fem.trials.grids import Line, grid
from reflowshock.fem.trials.parameters import Elastic

YOUNG, DENSITY = 10e9, 2000.0  # of bodies of trials [Pa], [kg/m^3]
LARGEST = 1.0  # movement over the edge of a box: far more than any element bears


def distorted(
    name: str, lines: tuple[Line, Line, Line], quality: float, seed: int, faces: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 3) and cells of a box between the lines of a grid, of a least scaled Jacobian.

    Args:
        name: Kind of element.
        lines: Along x, y and z.
        quality: Wanted; where even the grid has less, it stays as it is.
        seed: Of the random directions.
        faces: Whether nodes on the faces of the box move, too.
    """
    edges = np.array([np.diff(line).min() for line in lines])
    points, _ = grid(*lines)
    noise = np.random.default_rng(seed).uniform(-1.0, 1.0, points.shape) * edges
    if not faces:
        low, high = points.min(axis=0), points.max(axis=0)
        noise[((points == low) | (points == high)).any(axis=1)] = 0.0

    def made(amount: float) -> tuple[np.ndarray, np.ndarray]:
        return box(KINDS[name], *lines, move=lambda points: points + amount * noise)

    def excess(amount: float) -> float:
        points, cells = made(amount)
        return float(scaled_jacobians(points[cells]).min()) - quality

    if excess(0.0) <= 0.0:
        return made(0.0)
    return made(brentq(excess, 0.0, LARGEST, xtol=1e-6))


def laminate(poisson: float, orthotropy: float = 1.0, young: float = YOUNG) -> Material:
    """Return a material with a modulus [Pa] in x and y, the modulus in z smaller by ``orthotropy``."""
    if orthotropy == 1.0:
        return Isotropic(density=DENSITY, young_modulus=young, poisson_ratio=poisson)
    across, shear = young / orthotropy, 0.5 / (1.0 + poisson)
    return Orthotropic(
        density=DENSITY,
        young_modulus_in_plane=young,
        young_modulus_out_of_plane=across,
        poisson_ratio_in_plane=poisson,
        poisson_ratio_out_of_plane=poisson * min(1.0, orthotropy**0.5),
        shear_modulus_in_plane=young * shear,
        shear_modulus_out_of_plane=(young * across) ** 0.5 * shear,
    )


def body_of(given: Elastic, material: Material) -> Elements:
    """Return the elements of a trial, boxes 1 mm high."""
    flat = np.linspace(0.0, 1e-3 * given.aspect * given.cells, given.cells + 1)
    lines = (flat, flat, np.linspace(0.0, 1e-3 * given.cells, given.cells + 1))
    points, cells = distorted(given.element, lines, given.quality, given.seed)
    return elements_of(KINDS[given.element], points, cells, [material])
