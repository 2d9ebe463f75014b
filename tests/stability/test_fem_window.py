"""Stability of the two-scale window: spectral radii of the program's own operator.

At 0.9 of the element step, with two layers of board between interface and joint, the radius is at most 1 + 1e-8; the
naive scheme, with fine elements at the interface, must fail by the same measure.
"""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.coupled import surveyed
from reflowshock.cases.hard.trials.grids import grid, joint_mesh, mesh_of, on
from reflowshock.fem.division.checks import check_division
from reflowshock.fem.errors import CouplingError
from reflowshock.fem.mesh.mesh import MeshData, append, merge_nodes
from reflowshock.materials.library import SAC405, SILICON
from reflowshock.materials.parameters import Isotropic
from reflowshock.materials.roles import ELASTIC, Materials
from tests.support.fem_division import by_patch, naive
from tests.support.fem_window import Window

SOFT = Isotropic(density=1200.0, young_modulus=1e9, poisson_ratio=0.45)
EDGE, PATCH = 2e-3, 1.5e-3


def board(levels: np.ndarray, patch_bottom: float, edge: float = PATCH) -> MeshData:
    """Return a block of board, 4 x 4 columns of 0.5 mm, clamped at its far side; the patch ends at ``patch_bottom``."""
    ticks = np.linspace(0, EDGE, 5)
    points, cells = grid(ticks, ticks, levels)
    centre = points[cells].mean(axis=1)
    patch = (centre[:, :2] < edge).all(axis=1) & (centre[:, 2] > patch_bottom)
    facets = {
        "mounting_holes": on(0, EDGE),
        "board_side": lambda c: (np.abs(c[:, 2]) < 1e-9) & (c[:, :2] < PATCH).all(axis=1),
        "board_bottom": on(2, levels[0]),
    }
    return mesh_of(points, cells, np.where(patch, "board_patch", "board"), facets)


def with_joint(base: MeshData) -> MeshData:
    """Add a joint with a lid: a box of solder between pads with a free upper end."""
    joint = joint_mesh("A1", 0.5e-3, 0.5e-3, layers=2)
    facets = {name: quads for name, quads in joint.facets.items() if not name.startswith("head@")}
    return append([base, MeshData(joint.points, joint.cells, joint.part, joint.part_names, facets)])


@pytest.mark.parametrize("solder", [SAC405.elastic, SILICON, SOFT], ids=["solder", "stiff", "soft"])
def test_window_with_two_layers_of_board_does_not_grow(solder):
    mesh = with_joint(board(np.linspace(-1e-3, 0, 5), -0.5e-3))
    window = Window(mesh, Materials(solder=solder), fraction=0.9)
    assert window.plan.substeps >= 10
    assert window.spectral_radius() <= 1 + 1e-8


def test_fine_elements_at_the_cut_do_grow_when_the_window_ignores_them():
    mesh = board(np.array([-0.6e-3, -0.35e-3, -0.1e-3, -0.05e-3, 0.0]), -0.1e-3, edge=EDGE)
    ignoring = Window(mesh, ELASTIC, 0.9, naive)
    assert ignoring.plan.substeps > 1
    assert ignoring.spectral_radius() > 1 + 1e-3
    chosen = Window(mesh, ELASTIC, 0.9, by_patch)
    assert chosen.spectral_radius() <= 1 + 1e-8


def test_joint_one_layer_above_the_cut_is_refused():
    scene = surveyed(with_joint(board(np.linspace(-1e-3, 0, 5), -0.25e-3)))
    with pytest.raises(CouplingError, match="at least two layers"):
        check_division(*scene[:2], by_patch(*scene), scene[2])


def test_elements_of_other_parts_at_the_cut_are_refused():
    base = board(np.linspace(-1e-3, 0, 5), -0.5e-3)
    above = grid(np.linspace(0, PATCH, 4), np.linspace(0, PATCH, 4), [0, 0.25e-3])
    lid = mesh_of(*above, "die", {})
    mesh = append([base, lid])
    same, lower = np.nonzero((np.abs(lid.points[:, None] - base.points) < 1e-9).all(axis=2))
    mesh, _ = merge_nodes(mesh, (same + len(base.points)).astype(np.int32), lower.astype(np.int32))
    scene = surveyed(mesh)
    with pytest.raises(CouplingError, match=r"must belong to the board, found \d+ of die"):
        check_division(*scene[:2], by_patch(*scene), scene[2])
