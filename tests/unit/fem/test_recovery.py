"""Recovery of nodal values from element means."""

import numpy as np
import pytest

from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.point_table import fit, patch, point_table
from tests.support.fem_structures import LENGTH, THICKNESS, strip_mesh

SURFACE = (0.0, -4e-3 / 3, THICKNESS)


def around(mesh, node):
    """Return the cells near a node, their centres, and how many of them contain it."""
    cells = patch(mesh, node)
    centres = mesh.points[mesh.cells[cells]].mean(axis=1)
    return cells, centres, int((mesh.cells[cells] == node).any(axis=1).sum())


@pytest.mark.parametrize("target", [SURFACE, (LENGTH / 2, 4e-3, 0.0), (0.0, 4e-3 / 3, THICKNESS / 2)])
def test_linear_field_is_recovered_at_surfaces_corners_and_inside(target):
    mesh = strip_mesh()
    node = int(np.argmin(np.linalg.norm(mesh.points - target, axis=1)))
    cells, centres, nearest = around(mesh, node)
    weight = fit(centres, nearest, mesh.points[node])
    field = centres @ [3.0, -2.0, 500.0] + 0.7
    assert weight @ field == pytest.approx(mesh.points[node] @ [3.0, -2.0, 500.0] + 0.7, rel=1e-12)
    assert len(cells) <= 32


@pytest.mark.parametrize("target", [SURFACE, (LENGTH / 2, 4e-3, 0.0)])
def test_order_at_surfaces_and_corners(target):
    """For a bending strain that varies along the strip the error decreases with the square of the element size."""

    def strain(points):
        return np.sin(150.0 * points[:, 0] + 0.4) * np.cos(200.0 * points[:, 1]) * (points[:, 2] - THICKNESS / 2)

    errors = []
    for refined in (4, 8):
        mesh = strip_mesh((2 * refined, 3 * refined // 2, refined))
        node = int(np.argmin(np.linalg.norm(mesh.points - target, axis=1)))
        _, centres, nearest = around(mesh, node)
        size = LENGTH / (2 * refined), 8e-3 / (3 * refined // 2), THICKNESS / refined
        gauss = [0.5 * s * np.array([-1, 1]) / np.sqrt(3) for s in size]
        corners = np.stack(np.meshgrid(*gauss), axis=-1).reshape(-1, 3)
        means = np.mean([strain(centres + corner) for corner in corners], axis=0)
        exact = strain(mesh.points[node][None, :])[0]
        errors.append(abs(fit(centres, nearest, mesh.points[node]) @ means - exact) / THICKNESS)
    assert errors[1] < 0.02
    assert np.log2(errors[0] / errors[1]) > 1.7


def test_one_layer_of_elements_gives_the_value_of_its_middle():
    table = point_table(strip_mesh((8, 3, 1)), {"top": SURFACE}, {})
    assert np.allclose(table.points, [SURFACE])
    assert np.allclose(table.strain_points[0], [*SURFACE[:2], THICKNESS / 2])
    assert table.weight.sum() == pytest.approx(1.0)
    assert table.displaced == ["top"]
    middle = {"top": SURFACE, "origin": (0.0, -4e-3 / 3, 0.0)}
    assert not point_table(strip_mesh(), middle, {}).displaced


def test_patch_stays_in_the_lower_of_two_layers():
    mesh = strip_mesh((8, 3, 4), layers=("lower", "upper"))
    node = int(np.argmin(np.linalg.norm(mesh.points - [0.0, 4e-3 / 3, THICKNESS / 2], axis=1)))
    cells = patch(mesh, node)
    assert {mesh.part_names[part] for part in mesh.part[cells]} == {"lower"}


def test_point_outside_the_mesh_is_named_with_its_distance():
    with pytest.raises(MeshError, match=r"watch\.far\.at = .* nearest node is .* 0\.99 m\s+away"):
        point_table(strip_mesh(), {"far": (1.0, 0.0, 0.0)}, {})
