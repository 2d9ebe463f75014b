"""Boxes of layers: elements counted before they are made, layers and faces named, volumes exact, halves at symmetry."""

import math
from dataclasses import replace

import meshio
import numpy as np
import pytest

from reflowshock.meshing.board.box import write_box
from reflowshock.meshing.board.box_plan import Box, BoxHoles, BoxLayer, box_plan, box_problems, count_box

SIZE, THICKNESS = (40e-3, 20e-3), (1e-3, 0.5e-3)
LAYERS = (BoxLayer("board", THICKNESS[0], 2), BoxLayer("cover", THICKNESS[1], 1))
HOLES = BoxHoles((30e-3, 14e-3), 2e-3)
NODES = {"hexahedron": 8, "tetra": 4, "tetra10": 4}
KINDS = {"hexahedron": "hexahedron", "tetrahedron": "tetra", "tetrahedron_quadratic": "tetra10"}


def volume(mesh: meshio.Mesh) -> float:
    """Sum over tetrahedra; a hexahedron with its faces flat is six of them."""
    total = 0.0
    for block in mesh.cells:
        if block.type not in NODES:
            continue
        corners = mesh.points[block.data[:, : NODES[block.type]]]
        six = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
        for a, b, c, d in six if block.type == "hexahedron" else ((0, 1, 2, 3),):
            edges = corners[:, [b, c, d]] - corners[:, [a]]
            total += float(np.linalg.det(edges).sum()) / 6.0
    return total


@pytest.mark.parametrize("element", KINDS)
@pytest.mark.parametrize("holes", [None, HOLES], ids=["full", "holes"])
@pytest.mark.parametrize("symmetry", [(), ("x",), ("x", "y")], ids=["whole", "half", "quarter"])
def test_counts_names_and_volume(element, holes, symmetry, tmp_path):
    box = Box(SIZE, (16, 8), LAYERS, symmetry, element, holes)
    counts = write_box(box, tmp_path / "structure.msh")
    assert counts == {name: part.elements for name, part in count_box(box).items()}
    mesh = meshio.read(tmp_path / "structure.msh", file_format="gmsh")
    assert KINDS[element] in {block.type for block in mesh.cells}
    sides = {"x_min", "x_max", "y_min", "y_max", "z_min", "z_max"} | ({"mounting_holes"} if holes else set())
    assert set(mesh.field_data) == {"board", "cover"} | sides
    low = [0.0 if axis in symmetry else -0.5 * size for axis, size in zip("xy", SIZE, strict=True)]
    assert mesh.points.min(axis=0) == pytest.approx([*low, 0.0], abs=1e-12)
    assert mesh.points.max(axis=0) == pytest.approx([0.5 * SIZE[0], 0.5 * SIZE[1], sum(THICKNESS)], abs=1e-12)
    share = 0.5 ** len(symmetry)
    plan = box_plan(box)
    i, j = max(plan.holes, default=(0, 0))
    edges = 2 * (plan.x[i].cells + plan.y[j].cells) if holes else 1
    polygon = 0.5 * edges * (0.5 * HOLES.diameter) ** 2 * math.sin(2.0 * math.pi / edges)
    exact = share * (SIZE[0] * SIZE[1] - (4.0 * polygon if holes else 0.0)) * sum(THICKNESS)
    assert volume(mesh) == pytest.approx(exact, rel=2e-3 if holes else 1e-12)


def test_named_facets_lie_where_their_name_says(tmp_path):
    write_box(Box(SIZE, (16, 8), LAYERS, ("x",), holes=HOLES), tmp_path / "structure.msh")
    mesh = meshio.read(tmp_path / "structure.msh", file_format="gmsh")
    places = {"x_min": (0, 0.0), "x_max": (0, 20e-3), "y_min": (1, -10e-3), "z_min": (2, 0.0), "z_max": (2, 1.5e-3)}
    for name, (axis, coordinate) in places.items():
        assert mesh.points[nodes_of(mesh, name), axis] == pytest.approx(coordinate, abs=1e-12)
    holes = mesh.points[nodes_of(mesh, "mounting_holes")]
    radius = np.hypot(np.abs(holes[:, 0]) - 15e-3, np.abs(holes[:, 1]) - 7e-3)
    assert radius == pytest.approx(1e-3, rel=1e-9)
    assert sorted({round(z, 9) for z in holes[:, 2]}) == [0.0, 0.5e-3, 1e-3, 1.5e-3]


def test_layers_whose_elements_differ_share_no_node_and_name_both_faces(tmp_path):
    fine = BoxLayer("solder", 0.3e-3, 3, (24, 10))
    box = Box(SIZE, (16, 8), (LAYERS[0], fine, BoxLayer("top", 1e-3, 1, (24, 10)), LAYERS[1]), ("y",))
    assert [len(stack.layers) for stack in box.stacks] == [1, 2, 1]
    counts = write_box(box, tmp_path / "structure.msh")
    assert counts == {"board": 256, "solder": 720, "top": 240, "cover": 128}
    assert counts == {name: part.elements for name, part in count_box(box).items()}
    mesh = meshio.read(tmp_path / "structure.msh", file_format="gmsh")
    assert volume(mesh) == pytest.approx(0.5 * SIZE[0] * SIZE[1] * 2.8e-3, rel=1e-12)
    faces = {"slave@board-solder": 25 * 11, "master@board-solder": 17 * 9}
    faces |= {"slave@top-cover": 25 * 11, "master@top-cover": 17 * 9, "z_min": 17 * 9, "z_max": 17 * 9}
    face_nodes = {name: nodes_of(mesh, name) for name in faces}
    assert {name: len(nodes) for name, nodes in face_nodes.items()} == faces
    assert not np.intersect1d(face_nodes["slave@board-solder"], face_nodes["master@board-solder"]).size
    for name, height in {"board-solder": 1e-3, "top-cover": 2.3e-3}.items():
        for side in ("slave", "master"):
            assert mesh.points[face_nodes[f"{side}@{name}"], 2] == pytest.approx(height, abs=1e-12)
    assert len(nodes_of(mesh, "y_min")) == 17 * 3 + 25 * 5 + 17 * 2


@pytest.mark.parametrize(("changes", "words"), [({"element": "tetrahedron"}, "hexahedra"), ({"holes": HOLES}, "holes")])
def test_layers_whose_elements_differ_need_hexahedra_without_holes(changes, words):
    box = replace(Box(SIZE, (16, 8), (LAYERS[0], replace(LAYERS[1], in_plane=(8, 8)))), **changes)
    (problem,) = box_problems(box)
    assert problem.key == "structure.layers.cover.in_plane"
    assert words in problem.message
    assert box_problems(replace(box, layers=LAYERS)) == []


def nodes_of(mesh: meshio.Mesh, name: str) -> np.ndarray:
    """Return the numbers of the nodes of a named cell set, sorted."""
    pairs = zip(mesh.cells, mesh.cell_sets[name], strict=True)
    return np.unique(np.concatenate([block.data[chosen].ravel() for block, chosen in pairs if len(chosen)]))


def test_the_smallest_cell_is_that_of_the_plan():
    plain = count_box(Box(SIZE, (16, 8), LAYERS))["board"]
    assert plain.elements == 16 * 8 * 2
    assert plain.smallest == pytest.approx((2.5e-3, 2.5e-3, 0.5e-3))
