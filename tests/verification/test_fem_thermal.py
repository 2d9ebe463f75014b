"""Thermoelastic package and board against exact solutions: free expansion, bilayers (strip, plate), thin layers."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.mesh.mesh import append, select
from reflowshock.fem.problem.thermal import Thermal
from reflowshock.fem.statics.state import Assembly
from reflowshock.fem.statics.structure import ThermalStructure
from reflowshock.fem.statics.thermal_tables import RigidMotions
from reflowshock.materials.library import FR4
from reflowshock.materials.parameters import Isotropic
from reflowshock.materials.roles import Materials
from tests.support.fem_models import write_msh
from tests.support.thermal_models import (
    LIFT,
    REFERENCE,
    SOFT,
    STIFF,
    Layers,
    pads_at,
    structure_of,
)

RISE = 175.0


def bilayer_curvature(lower: Isotropic, upper: Isotropic, thickness: tuple[float, float], plate: bool) -> float:
    """Return the curvature [1/m] of a bilayer heated by 175 K, positive with ends up (Timoshenko, JOSA 11, 1925).

    A plate bends equally in both directions: E / (1 - nu) replaces E.
    """
    below, above = (material.young_modulus / (1.0 - plate * material.poisson_ratio) for material in (lower, upper))
    m, n = thickness[0] / thickness[1], below / above
    mismatch = (lower.thermal_expansion - upper.thermal_expansion) * RISE
    shape = 3.0 * (1.0 + m) ** 2 + (1.0 + m * n) * (m**2 + 1.0 / (m * n))
    return 6.0 * mismatch * (1.0 + m) ** 2 / (sum(thickness) * shape)


def lower_face(structure, width: float = 0.0) -> np.ndarray:
    """Return the nodes of the lower face of the package on the edge y = width."""
    points = structure.points
    chosen = structure.package & (np.abs(points[:, 2] - LIFT) < 1e-9) & (np.abs(points[:, 1] - width) < 1e-9)
    nodes = np.flatnonzero(chosen)
    return nodes[np.argsort(points[nodes, 0])]


def heated(structure, rise: float = RISE):
    """Return the solution of a structure heated by a rise of temperature [K]."""
    modes = structure.rigid_modes
    return structure.solve(REFERENCE + rise, 0.0, np.zeros(modes.pad_motion.shape[1:]), np.zeros(len(modes.names)))


@pytest.mark.parametrize("planes", [("symmetry_x", "symmetry_y"), ("symmetry_x",), ()])
def test_free_orthotropic_expansion_is_exact_on_any_shapes(tmp_path, planes):
    mesh = Layers(6e-3, 4e-3, (0.4e-3, 0.6e-3), (5, 4, 2, 3)).mesh(planes)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    inside = (mesh.points > low + 1e-9).all(axis=1) & (mesh.points < high - 1e-9).all(axis=1)
    inside &= np.abs(mesh.points[:, 2] - LIFT) > 1e-9
    mesh.points[inside] += 1e-4 * np.random.default_rng(0).uniform(-0.5, 0.5, (inside.sum(), 3))
    structure = structure_of(mesh, tmp_path, pads_at([(1e-3, 1e-3)], 0.3e-3), {"substrate": FR4, "die": FR4})
    strain, state = RISE * np.array(FR4.expansion), heated(structure)
    for mine in (structure.package, ~structure.package):
        points = structure.points[mine]
        error = state.displacement[mine] - strain * points
        rigid = RigidMotions(np.zeros(3), tuple(range(6))).fields(points).reshape(6, -1).T
        error = error.ravel() - rigid @ np.linalg.lstsq(rigid, error.ravel(), rcond=None)[0]
        assert np.abs(error).max() < 1e-11 * strain.max() * 6e-3


def strip(tmp_path: Path, cells: tuple[int, int, int, int], ratio: float = 0.0):
    """Return the structure of a bilayer strip and its exact curvature."""
    layers = Layers(10e-3, 1e-3, (0.4e-3, 0.25e-3), cells)
    soft, stiff = (material.model_copy(update={"poisson_ratio": ratio}) for material in (SOFT, STIFF))
    materials = {"substrate": soft, "die": stiff}
    structure = structure_of(layers.mesh(), tmp_path, pads_at([(1e-3, 0.25e-3), (3e-3, 0.25e-3)], 0.2e-3), materials)
    return structure, bilayer_curvature(soft, stiff, layers.thickness, plate=False)


def test_bimaterial_strip_has_timoshenko_curvature(tmp_path):
    structure, curvature = strip(tmp_path, (40, 2, 4, 4), 0.3)
    state = heated(structure)
    nodes = lower_face(structure)
    x, height = structure.points[nodes, 0], state.displacement[nodes, 2]
    assert height[-1] - height[0] == pytest.approx(curvature * x[-1] ** 2 / 2.0, rel=0.01)
    turn = state.pad_motion[:, 1, 4]
    assert np.diff(turn)[0] / -2e-3 == pytest.approx(curvature, rel=0.01)


def test_strip_converges_with_its_elements(tmp_path):
    middle, tip = [], []
    for fineness in (1, 2, 4, 8):
        folder = tmp_path / str(fineness)
        folder.mkdir()
        structure, curvature = strip(folder, (8 * fineness, 1, fineness, fineness))
        nodes = lower_face(structure)
        x, height = structure.points[nodes, 0], heated(structure).displacement[nodes, 2]
        near = x < 3e-3  # away from the ends, where the shear between the layers has decayed
        middle.append(2.0 * np.polyfit(x[near], height[near], 2)[0] / curvature - 1.0)
        tip.append(height[-1] - height[0])
    assert np.abs(middle).max() < 1e-3
    assert abs(middle[-1]) < 1e-6
    errors = np.abs(np.array(tip[:3]) / tip[3] - 1.0)
    assert errors[0] < 0.01
    assert np.log2(errors[:-1] / errors[1:]).min() > 1.0  # the end's corner is singular: less than second order


def test_plate_of_two_layers_bends_both_ways(tmp_path):
    layers = Layers(20e-3, 20e-3, (0.4e-3, 0.4e-3), (20, 20, 2, 2))
    soft, stiff = SOFT.model_copy(update={"poisson_ratio": 0.3}), STIFF.model_copy(update={"poisson_ratio": 0.2})
    pads = pads_at([(1e-3, 1e-3), (4e-3, 4e-3)], 0.3e-3)
    structure = structure_of(layers.mesh(), tmp_path, pads, {"substrate": soft, "die": stiff})
    turn = np.diff(heated(structure).pad_motion[:, 1, 3:], axis=0)[0]
    curvature = bilayer_curvature(soft, stiff, layers.thickness, plate=True)
    assert turn[:2] == pytest.approx(np.array([1.0, -1.0]) * 3e-3 * curvature, rel=0.002)
    assert turn[2] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("aspect", [5.0, 25.0])
def test_thin_layers_do_not_lock_under_the_moments_of_pads(tmp_path, aspect):
    length, cell = 10e-3, 0.5e-3
    thickness = (cell / aspect, cell / aspect)
    mesh = Layers(length, cell, thickness, (10, 1, 1, 1)).mesh()
    pads = pads_at([(4.75e-3, 0.125e-3)], 0.12e-3)
    structure = structure_of(mesh, tmp_path, pads, {"substrate": SOFT, "die": SOFT})
    moment, wrenches = 1e-6, np.zeros((1, 2, 6))
    wrenches[0, 1, 4] = -moment  # about y on half the width of the strip: ends up
    state = structure.solve(REFERENCE, 0.0, wrenches, np.zeros(1))
    nodes = lower_face(structure)
    x, height = structure.points[nodes, 0], state.displacement[nodes, 2]
    near = x < 3e-3
    bent = np.polyfit(x[near], height[near], 2)[0] * 2.0
    inertia = 0.5 * cell * sum(thickness) ** 3 / 12.0
    assert bent == pytest.approx(moment / (SOFT.young_modulus * inertia), rel=2e-3)


def test_a_board_sags_between_its_holes_as_a_beam(tmp_path):
    layers = Layers(20e-3, 0.5e-3, (0.4e-3, 0.4e-3), (1, 1, 1, 1))
    package = layers.mesh()
    x = np.linspace(0.0, 10e-3, 21)
    sides = {
        "symmetry_x": on(0, 0.0),
        "symmetry_y": on(1, 0.0),
        "board_side": on(2, 0.0),
        "mounting_holes": on(0, 10e-3),
    }
    board = mesh_of(*grid(x, [0.0, 0.25e-3], [-0.2e-3, -0.1e-3, 0.0]), "board", sides)
    mesh = append([board, select(package, lambda name: name != "board")[0]])
    write_msh(mesh, tmp_path / "assembly.msh")
    pads = pads_at([(1e-3, 0.12e-3)], 0.1e-3)
    assembly = Assembly(tmp_path / "assembly.msh", pads, Materials(board=SOFT), Thermal(), gravity=9.81)
    structure = ThermalStructure.build(MPI.COMM_SELF, assembly)
    points, height = structure.points, heated(structure, 0.0).displacement[:, 2]
    top = ~structure.package & (np.abs(points[:, 2]) < 1e-9) & (np.abs(points[:, 1]) < 1e-9)
    order = np.flatnonzero(top)[np.argsort(points[top, 0])]
    sag = height[order[-1]] - height[order[0]]
    load, rigidity = 9.81 * SOFT.density * 0.2e-3, SOFT.young_modulus * 0.2e-3**3 / 12.0
    assert sag == pytest.approx(5.0 / 384.0 * load * 20e-3**4 / rigidity, rel=0.002)
