"""Beams, laminates and plates of each element type against exact values: locking."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.beams import beam, tip
from reflowshock.cases.hard.trials.boxes import KINDS, box, elements_of, frequencies
from reflowshock.fem.mesh.mesh_file import scaled_jacobians
from reflowshock.materials.library import FR4
from reflowshock.materials.parameters import Isotropic, Material

HEXAHEDRA = ["incompatible_modes", "one_point"]
NOT_LOCKING = pytest.mark.parametrize("name", [*HEXAHEDRA, "tetrahedron_quadratic"])
MILLIMETRE = 1e-3


def isotropic(young: float, poisson: float = 0.0) -> Material:
    """Return an elastic material from Young's modulus [Pa] and Poisson's ratio."""
    return Isotropic(density=2000.0, young_modulus=young, poisson_ratio=poisson)


def strip(length: float, width: float, height: float, counts: tuple[int, int, int]) -> list[np.ndarray]:
    """Return the grid lines of a strip along x, y and z, from sizes and element numbers."""
    return [np.linspace(0, size, count + 1) for size, count in zip((length, width, height), counts, strict=True)]


def ratio(name: str, size: tuple[float, float, float], counts: tuple[int, int, int], poisson=0.0, move=None) -> float:
    """Return the ratio of the tip deflection to the exact value."""
    deflection = tip(KINDS[name], strip(*size, counts), [isotropic(1e9, poisson)], move=move or (lambda points: points))
    return deflection / beam(*size[:2], np.array(size[2:]), np.array([1e9]), poisson)


@NOT_LOCKING
@pytest.mark.parametrize("aspect", [1.0, 25.0])
@pytest.mark.parametrize("poisson", [0.0, 0.499])
def test_bending_does_not_lock_with_the_aspect_of_the_elements(name, aspect, poisson):
    assert ratio(name, (16 * aspect, 4.0, 4.0), (16, 2, 4), poisson) == pytest.approx(1.0, abs=0.02)


@NOT_LOCKING
def test_bending_does_not_lock_when_nearly_incompressible(name):
    assert ratio(name, (10.0, 1.0, 1.0), (16, 2, 2), 0.499) == pytest.approx(1.0, abs=0.02)


def test_linear_tetrahedra_lock():
    """This known error excludes them from bodies in bending."""
    assert ratio("tetrahedron", (400.0, 1.0, 4.0), (16, 1, 4)) < 0.1
    assert ratio("tetrahedron", (10.0, 1.0, 1.0), (16, 2, 2), 0.499) < 0.2


@pytest.mark.parametrize("name", HEXAHEDRA)
def test_skewed_hexahedra_bend_and_converge(name):
    """At scaled Jacobian 0.2, elements as long as the beam height are 8 % too stiff; second order."""

    def skewed(points):
        fade = np.clip(np.minimum(points[:, 0], 10 - points[:, 0]) / 2.5, 0, 1)
        return points + (4.9 * fade * (points[:, 1] - 0.5))[:, None] * [1.0, 0.0, 0.0]

    counts = [(16, 2, 2), (32, 4, 4)]
    points, cells = box(KINDS[name], *strip(10.0, 1.0, 1.0, counts[0]), move=skewed)
    assert scaled_jacobians(points[cells]).min() == pytest.approx(0.2, rel=0.01)
    coarse, fine = (1 - ratio(name, (10.0, 1.0, 1.0), count, 0.3, skewed) for count in counts)
    assert 0 < coarse < 0.1
    assert fine < 0.03


@NOT_LOCKING
def test_copper_foil_of_aspect_25_between_layers_of_board(name):
    """A 0.02 mm copper foil lies in 1 mm of FR4, with elements of 0.5 mm."""
    heights = np.array([0.48, 0.02, 0.5]) * MILLIMETRE
    young = np.array([FR4.young_modulus_in_plane, 141.92e9, FR4.young_modulus_in_plane])
    length, width = 20 * MILLIMETRE, 1 * MILLIMETRE
    z = np.array([0.0, 0.24, 0.48, 0.5, 0.75, 1.0]) * MILLIMETRE
    lines = [*strip(length, width, 1.0, (40, 2, 1))[:2], z]
    deflection = tip(KINDS[name], lines, [isotropic(value) for value in young], lambda c: np.searchsorted(z[[2, 3]], c))
    assert deflection == pytest.approx(beam(length, width, heights, young), rel=0.01)


@NOT_LOCKING
def test_stiffness_jump_of_100(name):
    heights, young = np.array([0.25, 0.5, 0.25]) * MILLIMETRE, np.array([1e9, 1e11, 1e9])
    length, width = 20 * MILLIMETRE, 1 * MILLIMETRE
    z = np.array([0.0, 0.125, 0.25, 0.5, 0.75, 0.875, 1.0]) * MILLIMETRE
    lines = [*strip(length, width, 1.0, (40, 2, 1))[:2], z]
    deflection = tip(KINDS[name], lines, [isotropic(value) for value in young], lambda c: np.searchsorted(z[[2, 4]], c))
    assert deflection == pytest.approx(beam(length, width, heights, young), rel=0.01)


SIDE, THICKNESS = 0.1, 1e-3


def plate_ratios(name: str, elements: int, simply_supported: bool) -> np.ndarray:
    """Return the first three frequencies of symmetric modes of a quarter plate over the exact thin-plate values."""
    young, poisson = 70e9, 0.3
    side = np.linspace(0, SIDE / 2, elements + 1)
    points, cells = box(KINDS[name], side, side, [0, THICKNESS])
    material = isotropic(young, poisson)
    x, y = (points[:, :2] > SIDE / 2 - 1e-9).T
    held = np.abs(points) < 1e-12
    held[:, 2] = False
    if simply_supported:
        held[np.ix_(x, [1, 2])] = held[np.ix_(y, [0, 2])] = True
        factors = np.pi**2 * np.array([2.0, 10.0, 10.0])  # Navier
    else:
        held[x | y] = True
        factors = np.array([35.992, 131.64, 132.24])  # Leissa, J. Sound Vib. 31 (1973)
    rigidity = young * THICKNESS**3 / (12 * (1 - poisson**2))
    exact = factors / (2 * np.pi * SIDE**2) * np.sqrt(rigidity / (material.density * THICKNESS))
    return frequencies(elements_of(KINDS[name], points, cells, [material]), held, 3) / exact


@pytest.mark.parametrize("name", HEXAHEDRA)
@pytest.mark.parametrize("simply_supported", [True, False], ids=["simply supported", "clamped"])
def test_plate_frequencies(name, simply_supported):
    assert plate_ratios(name, 16, simply_supported) == pytest.approx(np.ones(3), abs=0.01)


def test_plate_of_quadratic_tetrahedra():
    assert plate_ratios("tetrahedron_quadratic", 10, True)[0] == pytest.approx(1.0, abs=0.01)
    assert plate_ratios("tetrahedron_quadratic", 10, False)[0] == pytest.approx(1.0, abs=0.025)
