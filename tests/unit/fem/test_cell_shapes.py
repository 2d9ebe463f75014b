"""Meshes of each cell shape: files, faces, facets, quality, DOLFINx."""

import gmsh
import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.cell_shape import HEXAHEDRON, TETRAHEDRON, TETRAHEDRON_QUADRATIC
from reflowshock.fem.division.tables import prepare
from reflowshock.fem.elements.tetrahedron import EDGES
from reflowshock.fem.errors import MeshError
from reflowshock.fem.kernels.hexahedron import SIDES
from reflowshock.fem.mesh.facet import area_vectors
from reflowshock.fem.mesh.facet_areas import outward_areas
from reflowshock.fem.mesh.mesh import append, boundary_facets, cells_of_facets
from reflowshock.fem.mesh.mesh_file import read_mesh, scaled_jacobians
from reflowshock.fem.model.assembly import make_body, make_rank_elements
from reflowshock.fem.output.fields import Fields
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.materials.roles import ELASTIC

SIZE = np.array([3.0, 2.0, 1.0])
SHAPES = [HEXAHEDRON, TETRAHEDRON, TETRAHEDRON_QUADRATIC]


def write_box(path, shape, mixed=False, spoil=None) -> None:
    """Mesh a box with Gmsh, one physical volume ``board``, its top the facet set ``z_max``."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMin", 0.8)
        box = gmsh.model.occ.addBox(0, 0, 0, *SIZE)
        if mixed:
            gmsh.model.occ.addBox(5, 0, 0, *SIZE)
        gmsh.model.occ.synchronize()
        if shape is HEXAHEDRON or mixed:
            for _, curve in gmsh.model.getBoundary(gmsh.model.getBoundary([(3, box)], combined=False), combined=False):
                gmsh.model.mesh.setTransfiniteCurve(abs(curve), 3)
            for _, surface in gmsh.model.getBoundary([(3, box)], oriented=False):
                gmsh.model.mesh.setTransfiniteSurface(surface)
                gmsh.model.mesh.setRecombine(2, surface)
            gmsh.model.mesh.setTransfiniteVolume(box)
        volumes = [tag for _, tag in gmsh.model.getEntities(3)]
        gmsh.model.addPhysicalGroup(3, volumes, name="board")
        top = gmsh.model.getEntitiesInBoundingBox(-0.1, -0.1, SIZE[2] - 0.1, 9, 9, SIZE[2] + 0.1, 2)
        gmsh.model.addPhysicalGroup(2, [tag for _, tag in top], name="z_max")
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2 if shape is TETRAHEDRON_QUADRATIC else 1)
        if spoil:
            spoil()
        gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


@pytest.fixture(params=SHAPES, ids=lambda shape: shape.name)
def box(request, tmp_path):
    """Return the mesh of a box of one cell shape."""
    write_box(tmp_path / "box.msh", request.param)
    mesh = read_mesh(tmp_path / "box.msh")
    assert mesh.shape is request.param
    return mesh


def test_nodes_on_edges_lie_between_their_vertices(box):
    if box.shape is TETRAHEDRON_QUADRATIC:
        assert np.allclose(box.points[box.cells[:, 4:]], box.points[box.cells[:, EDGES]].mean(axis=2), atol=1e-14)


def test_boundary_is_closed_and_facets_know_their_cells(box):
    facets = box.facets["z_max"]
    owners = cells_of_facets(box.cells, facets)
    assert all(set(facet) <= set(box.cells[owner]) for facet, owner in zip(facets, owners, strict=True))
    everything = boundary_facets(box.cells)
    assert len(everything) == len(np.unique(np.sort(everything, axis=1), axis=0))
    assert set(facets.ravel()) <= set(everything.ravel())


def test_pressure_on_a_face_has_its_area_and_its_centre(box):
    nodes, vectors = outward_areas(box, "z_max")
    assert np.allclose(vectors.sum(axis=0), [0.0, 0.0, SIZE[0] * SIZE[1]], atol=1e-13)
    moment = np.cross(box.points[nodes], vectors).sum(axis=0)
    assert np.allclose(moment, np.cross(0.5 * SIZE, [0.0, 0.0, SIZE[0] * SIZE[1]]), atol=1e-12)


def test_area_vector_of_a_curved_triangle_is_that_of_its_edge():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0.2], [0.5, 0.5, 0.1], [0, 0.5, -0.1]])
    ring = corners[[0, 3, 1, 4, 2, 5]]
    a, middle, b = ring[::2], ring[1::2], np.roll(ring[::2], -1, axis=0)
    along_parabolas = (2 * np.cross(a, middle) + 2 * np.cross(middle, b) - 0.5 * np.cross(a, b)) / 3.0
    exact = along_parabolas.sum(axis=0)
    assert np.allclose(area_vectors(corners[None])[0].sum(axis=0), exact, atol=1e-14)


def test_dolfinx_keeps_nodes_and_writes_fields(box, tmp_path):
    item = prepare(box, "dns")["dns"]
    local = distribute(MPI.COMM_SELF, item.mesh)
    assert np.array_equal(local.nodes[local.cells], item.mesh.cells[local.cell_numbers])
    assert np.array_equal(local.points, item.mesh.points[local.nodes])
    rank_elements = make_rank_elements(local, item.tables, ELASTIC)
    body = make_body(MPI.COMM_SELF, rank_elements, item.tables, np.ones(len(rank_elements.steps)))
    fields = Fields(MPI.COMM_SELF, body, item.tables.part[local.cell_numbers], tmp_path / "fields.pvd")
    fields.write(fields.sample(1e-3 * local.points, 0.0))
    fields.close()
    assert list(tmp_path.glob("fields*.vtu"))


def test_mixed_cells_are_an_error_that_names_them(tmp_path):
    write_box(tmp_path / "box.msh", HEXAHEDRON, mixed=True)
    with pytest.raises(MeshError, match=r"one shape are needed .* found hexahedron, tetra"):
        read_mesh(tmp_path / "box.msh")


FAULTS = [(shape, *fault) for shape in SHAPES for fault in [(0.0, "without volume"), (-1.0, "turned inside out")]]


@pytest.mark.parametrize("shape, height, fault", [*FAULTS, (TETRAHEDRON, 1e-5, "too distorted")])
def test_bad_cell_is_an_error_with_number_part_and_place(tmp_path, shape, height, fault):
    def spoil():
        nodes, points, _ = gmsh.model.mesh.getNodes()
        for node, point in zip(nodes, points.reshape(-1, 3), strict=True):
            gmsh.model.mesh.setNode(int(node), point * [1.0, 1.0, height], [])

    write_box(tmp_path / "box.msh", shape, spoil=spoil)
    with pytest.raises(MeshError, match=rf"element \d+ of part board at \(.*\) m is {fault}"):
        read_mesh(tmp_path / "box.msh")


def test_meshes_of_different_shapes_are_not_one(tmp_path):
    meshes = []
    for shape in (HEXAHEDRON, TETRAHEDRON):
        write_box(tmp_path / "box.msh", shape)
        meshes.append(read_mesh(tmp_path / "box.msh"))
    with pytest.raises(MeshError, match="cells of one shape, found hexahedron, tetra"):
        append(meshes)


def test_scaled_jacobian_of_known_cells():
    cube = 0.5 * SIDES
    skewed = cube.copy()
    skewed[:, 0] += 5.0 * cube[:, 2]
    assert scaled_jacobians(cube[None] * [25.0, 1.0, 3.0]) == pytest.approx(1.0)
    assert scaled_jacobians(skewed[None]) == pytest.approx(1 / np.sqrt(26.0))
    regular = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])[[0, 2, 1, 3]]
    quadratic = np.vstack([regular, regular[EDGES].mean(axis=1)])
    assert abs(scaled_jacobians(regular[None])) == pytest.approx(1.0)
    assert scaled_jacobians(quadratic[None]) == pytest.approx(scaled_jacobians(regular[None]))
