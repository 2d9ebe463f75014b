"""One joint between patches of board and substrate, tied to boxes or in columns, and its static equilibrium.

The patches are 3 x 3 mm, the board is 1 mm and the substrate 0.4 mm thick. A cylinder of solder of radius 0.24 mm and
height 0.30 mm stands between two copper discs. The substrate is held at its sides x = -+1.5 mm, the board at x = -1.5
mm; its other side moves 6 um outwards and 6 um away. Rotated about the axis of the joint, the same motion is prescribed
on all sides in proportion to their distance.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise, product

import numpy as np
import scipy.sparse
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from reflowshock.cases.hard.trials.packages import MM, board, package
from reflowshock.cases.hard.trials.surfaces import barrel
from reflowshock.fem.cell_shape import HEXAHEDRON
from reflowshock.fem.division.split import part_of
from reflowshock.fem.division.tables import join_meshes
from reflowshock.fem.division.whole import Whole
from reflowshock.fem.elements.mesh_elements import elements_of
from reflowshock.fem.elements.stress import von_mises
from reflowshock.fem.forces.force_assembled import AssembledElements
from reflowshock.fem.mesh.mesh import MeshData, append
from reflowshock.fem.mesh.pad_layer import octant_volumes
from reflowshock.fem.model.factorisation import Factorisation
from reflowshock.fem.statics.hencky import HenckyElements
from reflowshock.materials.library import COPPER, FR4
from reflowshock.materials.parameters import Isotropic, JohnsonCook, Material
from reflowshock.materials.roles import role_of_part
from reflowshock.meshing.board.package_side import PackageSide, StructuredFace, underside
from reflowshock.meshing.board.pads import PadSite, pad_table
from reflowshock.meshing.board.parameters import Imprint, JointNumerics, Package, Warpage
from reflowshock.meshing.joint.attempts import first_valid_mesh, free_form
from reflowshock.meshing.joint.column import Column, columns_of
from reflowshock.meshing.joint.joint_mesh import CopperPads, JointMesh, JointPlace, build_joint
from reflowshock.meshing.joint.solder_mesh import mesh_joint
from reflowshock.meshing.surface.closed_surface import ClosedSurface

Floats = NDArray[np.float64]
SIDE, STRETCH, LIFT = 3.0 * MM, 6.0e-6, 6.0e-6
LAYER = 25.0e-6
SAME = 1e-9  # m
UP = np.array([0.0, 0.0, 1.0])
HARDENING = JohnsonCook(A=40e6, B=1e9, n=1.0)
SOLDER = Isotropic(density=7440.0, young_modulus=44.6e9, poisson_ratio=0.40)
CONVERGED, NEAR = 1e-8, 1e-3  # tolerance of the relative residual, final and intermediate
SHARES = (0.25, 0.5, 0.75, 1.0)
JOINT = "A1"
TODAY = {"core": 3, "rings": 1, "layers": 6}
CHEAPEST = {"core": 4, "rings": 2, "layers": 10, "pad_layer": LAYER, "copper_layers": 2}
PADS = {"diameter": 0.48 * MM, "mask_opening": 0.58 * MM, "definition": "NSMD"}


@dataclass(frozen=True, slots=True)
class Mesh:
    """Mesh settings of the patch: box size [m] and shift, fields of ``package``, swept or free-form."""

    box: float
    joint: dict
    imprint: dict | None = None
    layers: tuple[int, int] = (4, 2)
    shift: float = 0.0
    swept: bool = True

    def times(self, size: float) -> "Mesh":
        """Return settings with all element sizes multiplied by ``size``."""
        numerics, imprint = JointNumerics.model_validate(self.joint), self.imprint
        names = ["core", "rings", "layers", "copper_layers", *(["pad_layers"] if numerics.pad_layer else [])]
        counts = {name: round(getattr(numerics, name) / size) for name in names}
        if imprint is not None:
            settings = Imprint.model_validate(imprint)
            sized = {"growth": 1.0 + size * (settings.growth - 1.0), "first_layer": size * settings.first_layer}
            imprint = imprint | sized | {"rings": round(settings.rings / size)}
        layers = tuple(round(count / size) for count in self.layers)
        return replace(self, box=size * self.box, joint=self.joint | counts, imprint=imprint, layers=layers)


def patch(mesh: Mesh) -> tuple[Whole, JointMesh]:
    """Mesh patches of board and substrate and the joint between them.

    Args:
        mesh: Settings of the mesh.

    Returns:
        Joined mesh of all parts with its ties, and the mesh of the joint.
    """
    numerics = {"element_size": mesh.box}
    layer = {"length": SIDE, "width": SIDE, "thickness": 0.4 * MM, "elements": mesh.layers[1]}
    package_of_joint = package(
        rows=1, columns=1, standoff=0.30 * MM, board_pad=PADS, package_pad=PADS, joint_numerics=mesh.joint,
        imprint=mesh.imprint, substrate=layer, numerics=numerics,
    )  # fmt: skip
    below = board(symmetry="full", numerics={"layers": mesh.layers[0], "patch_layers": 1})
    lines = box_lines(mesh)
    levels = underside(package_of_joint) + layer["thickness"] * np.arange(mesh.layers[1] + 1) / mesh.layers[1]
    at_rest = StructuredFace(lines, lines, np.zeros((len(lines), len(lines), 3)))
    side = PackageSide(float(levels[0]), at_rest, tuple((float(level), at_rest) for level in levels[1:]))
    site = pad_table(package_of_joint, below, Warpage())[0]
    how = mesh_joint if mesh.swept else free_form_joint
    joint = how(barrel(site.gap, 0.0), site, package_of_joint, side, columns_of(site, package_of_joint, below, side))
    depths = below.thickness * (np.arange(mesh.layers[0] + 1) / mesh.layers[0] - 1.0)
    pieces = [boxes("board", lines, depths), boxes("substrate", lines, levels), data_of(joint)]
    return join_meshes(append(pieces)), joint


def free_form_joint(
    surface: ClosedSurface, site: PadSite, whole: Package, side: PackageSide, columns: tuple[Column, ...]
) -> JointMesh:
    """Mesh a joint by the free-form method even if it could be swept; arguments as of ``mesh_joint``.

    Args:
        surface: Closed surface of the solder.
        site: Positions and sizes of its pads.
        whole: Package with copper and numerics.
        side: Underside of the package.
        columns: Columns of board and substrate that continue the pads.
    """
    copper = CopperPads(whole.copper.thickness, whole.joint_numerics.copper_layers, columns=columns)
    joint_place = JointPlace.of(surface, site, side, copper.thickness)
    build = partial(build_joint, sites=[site], copper=copper, place=joint_place)
    return first_valid_mesh(surface, free_form(surface, whole.joint_numerics, joint_place), site.name, build)


def box_lines(mesh: Mesh) -> Floats:
    """Return the grid lines of the boxes along x and y, shape (n,) [m].

    The shift of the mesh settings moves all lines except the sides and the edges of the column.
    """
    count = round(SIDE / mesh.box)
    lines = SIDE * (np.arange(count + 1) / count - 0.5)
    if not mesh.shift:
        return lines
    edges = 0.5 * np.array([mesh.imprint["size"] if mesh.imprint else SIDE, SIDE])
    moved = np.concatenate([lines[:-1] + mesh.shift * mesh.box, edges, -edges])
    return np.unique(np.round(moved, 12))


def boxes(name: str, x: Floats, levels: Floats, y: Floats | None = None) -> MeshData:
    """Return a block of boxes, with its face towards the joint as the facet set ``NAME_side``.

    Args:
        name: Name of the part; of any other part than "board" the lower face is the set ``package_side``.
        x: Grid lines along x [m].
        levels: Grid lines along z [m].
        y: Grid lines along y [m]; None for those along x.
    """
    lines = levels, x if y is None else y, x
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)[..., ::-1].reshape(-1, 3)
    number = np.arange(len(points)).reshape([len(line) for line in lines])
    corners = [
        number[tuple(slice(side, side - 1 or None) for side in sides)].ravel() for sides in product((0, 1), repeat=3)
    ]  # bit d of a corner's index is its side along x, y, z
    face = number[-1] if name == "board" else number[0]
    around = [face[:-1, :-1], face[:-1, 1:], face[1:, 1:], face[1:, :-1]]
    quads = np.column_stack([some.ravel() for some in around]).astype(np.int32)
    cells = np.column_stack(corners).astype(np.int32)
    facets = {"board_side" if name == "board" else "package_side": quads}
    return MeshData(np.ascontiguousarray(points), cells, np.zeros(len(cells), np.int32), (name,), facets)


def data_of(joint: JointMesh) -> MeshData:
    """Return the mesh of a joint in the form that the fem program reads: nodes, cells, parts and facet sets."""
    parts = [np.full(len(cells), number, np.int32) for number, cells in enumerate(joint.cells.values())]
    cells = np.concatenate(list(joint.cells.values()))[:, HEXAHEDRON.order]
    return MeshData(joint.points, cells, np.concatenate(parts), tuple(joint.cells), joint.facets)


class Problem:
    """Static problem of a mesh with its prescribed motion."""

    def __init__(
        self,
        whole: Whole,
        yields: bool,
        materials_by_role: dict[str, Material] | None = None,
        turned: float | None = None,
    ) -> None:
        """Number the equations of a mesh with elastic or yielding solder, or with given materials.

        Args:
            whole: Mesh.
            yields: Whether the solder yields.
            materials_by_role: Role -> material; overrides ``yields``.
            turned: Angle [rad] of the motion.
        """
        mesh = whole.mesh
        solder = SOLDER.model_copy(update={"plasticity": HARDENING}) if yields else SOLDER
        materials_by_role = materials_by_role or {"board": FR4, "substrate": FR4, "copper": COPPER, "solder": solder}
        materials = [materials_by_role[role_of_part(name)] for name in mesh.part_names]
        self.whole, self.yields = whole, yields
        self.elements = elements_of(mesh.points, mesh.cells, mesh.part, materials)
        self.hencky = HenckyElements.build(self.elements, materials, np.zeros((len(materials), 3)))
        count = len(mesh.points)
        self.tie = scipy.sparse.kron(whole.tie.matrix(count), scipy.sparse.identity(3), format="csr")
        self.motion, held = prescribed(mesh) if turned is None else prescribed_at(mesh, turned)
        free = ~held
        free[whole.tie.slave] = False
        self.free = np.flatnonzero(free.ravel())

    def solve(self) -> Floats:
        """Return the displacement [m], shape (n, 3), by Newton's method, in increments if the solder yields."""
        shares = SHARES if self.yields else (1.0,)
        displacement = self._spread(shares[0] * self.motion)
        for share, following in pairwise((*shares, 1.0)):
            displacement = self._balanced(displacement, CONVERGED if share == 1.0 else NEAR) * (following / share)
        return displacement

    def _balanced(self, displacement: Floats, tolerance: float) -> Floats:
        for _ in range(30):
            force, tangent = self.hencky.linearised(displacement)
            rest = (self.tie.T @ force.ravel())[self.free]
            error = float(np.linalg.norm(rest) / np.linalg.norm(force))
            if error <= tolerance:
                return displacement
            step = np.zeros(displacement.size)
            step[self.free] = -solution(self._reduced(tangent), rest)
            displacement = displacement + self._spread(step.reshape(-1, 3))
        raise RuntimeError(f"forces out of balance by {error:.1e}")

    def _spread(self, values: Floats) -> Floats:
        return (self.tie @ values.ravel()).reshape(-1, 3)

    def _reduced(self, tangent: AssembledElements) -> scipy.sparse.csr_matrix:
        size = self.tie.shape[0]
        half = scipy.sparse.bsr_matrix((tangent.blocks, tangent.columns, tangent.pointer), shape=(size, size))
        half = (self.tie.T @ half.tocsr() @ self.tie).tocsr()
        return (half + half.T)[self.free][:, self.free].tocsr()


def solution(matrix: scipy.sparse.csr_matrix, right: Floats) -> Floats:
    """Return the solution of a symmetric linear system by MUMPS, shape (n,).

    Args:
        matrix: Matrix, shape (n, n).
        right: Right-hand side, shape (n,).
    """
    csr = (matrix.indptr.astype(np.int32), matrix.indices.astype(np.int32), matrix.data)
    petsc = PETSc.Mat().createAIJ(matrix.shape, csr=csr, comm=MPI.COMM_SELF)
    petsc.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    factor, (vector_in, vector) = Factorisation(petsc), petsc.createVecs()
    vector.array = right
    factor.solve(vector, vector_in)
    solution_values = np.array(vector_in.array)
    factor.free()
    petsc.destroy()
    return solution_values


def prescribed(mesh: MeshData) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the full motion of the patches' sides at x = const, and which components are prescribed.

    Args:
        mesh: Mesh of both patches and the joint; on a half mesh y = 0 is a plane of symmetry.

    Returns:
        Displacements, shape (n, 3) [m], and whether each component is prescribed, shape (n, 3).
    """
    held = np.abs(np.abs(mesh.points[:, 0]) - 0.5 * SIDE) < SAME
    on_board = held & (mesh.points[:, 2] <= SAME) & (mesh.points[:, 0] > 0.0)
    motion = np.zeros_like(mesh.points)
    motion[on_board] = [STRETCH, 0.0, -LIFT]
    components = np.repeat(held[:, None], 3, axis=1)
    if is_half(mesh):
        components[:, 1] |= mesh.points[:, 1] < SAME
    return motion, components


def prescribed_at(mesh: MeshData, angle: float) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the motion of all sides of the patches along a direction in plan, and which components are prescribed.

    Args:
        mesh: Mesh of both patches and the joint.
        angle: Direction of the motion, from the x axis [rad].

    Returns:
        Displacements, shape (n, 3) [m], and whether each component is prescribed, shape (n, 3).
    """
    along = np.array([np.cos(angle), np.sin(angle), 0.0])
    held = np.abs(np.abs(mesh.points[:, :2]) - 0.5 * SIDE).min(axis=1) < SAME
    share = np.where(held & (mesh.points[:, 2] <= SAME), 0.5 + mesh.points @ along / SIDE, 0.0)
    return share[:, None] * (STRETCH * along - [0.0, 0.0, LIFT]), np.repeat(held[:, None], 3, axis=1)


def half_of(whole: Whole) -> Whole:
    """Return the half y >= 0 of a joined symmetric mesh, which has a line of nodes at y = 0, with its ties."""
    tie, each = whole.tie, np.arange(len(whole.tie.slave))
    heaviest = tie.master[each, tie.weight.argmax(axis=1)][:, None]
    on_plane = replace(tie, master=np.where(tie.weight < SAME, heaviest, tie.master))  # zero weight at y < 0
    part = part_of(replace(whole, tie=on_plane), whole.mesh.points[whole.mesh.cells].mean(axis=1)[:, 1] > 0.0)
    return Whole(part.mesh, part.tie, whole.moved)


def is_half(mesh: MeshData) -> bool:
    """Return whether a mesh has no nodes at y < 0, as ``half_of`` returns it."""
    return bool(mesh.points[:, 1].min() > -SAME)


def ends(
    problem: Problem, displacement: Floats, layers: Sequence[float] = (LAYER,)
) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield the name of each end of the joint, "board" or "package", and its measures by name.

    Args:
        problem: Static problem with mesh and materials.
        displacement: Displacements of the nodes, shape (n, 3) [m].
        layers: Thicknesses of the layers at the pad over which averages are taken [m].

    Yields:
        Name and ``axial_force``, ``shear_force`` [N], ``bending_moment`` [N m], and for each layer ``von_mises:Num``
        [Pa] and ``plastic_work:Num`` [J/m^3].
    """
    mesh = problem.whole.mesh
    cells = mesh.in_parts(f"solder@{JOINT}".__eq__)
    solder = replace(problem.hencky, elements=problem.elements.subset(cells))
    response = solder.respond(displacement)
    force = np.zeros_like(mesh.points)
    np.add.at(force, mesh.cells[cells], response.force.reshape(-1, 8, 3))
    if is_half(mesh):
        force *= [2.0, 0.0, 2.0]
    state, corners = solder.points(displacement), mesh.points[mesh.cells[cells]]
    plastic = state.plastic_strain
    stress = von_mises(state.stress.reshape(-1, 6)).reshape(plastic.shape)
    work = HARDENING.A * plastic + HARDENING.B * plastic ** (1.0 + HARDENING.n) / (1.0 + HARDENING.n)
    for name, inward in (("board", UP), ("package", -UP)):
        nodes = mesh.facet_nodes(f"pad_{name}@{JOINT}")
        level = mesh.points[nodes, 2].mean()
        on_pad = force[nodes]
        arm = mesh.points[nodes] - [0.0, 0.0, level]
        moment = np.cross(arm * [1.0, 0.0, 1.0] if is_half(mesh) else arm, on_pad).sum(axis=0)
        measures = {
            "axial_force": abs(float(on_pad[:, 2].sum())),
            "shear_force": float(np.linalg.norm(on_pad[:, :2].sum(axis=0))),
            "bending_moment": float(np.linalg.norm(moment[:2])),
        }
        for layer in layers:
            near = octant_volumes(corners, np.array([0.0, 0.0, level]), inward, layer)
            measures[f"von_mises:{1e6 * layer:g}um"] = float(np.average(stress, weights=near))
            measures[f"plastic_work:{1e6 * layer:g}um"] = float(np.average(work, weights=near))
        yield name, measures


IMPRINTED = Mesh(0.25 * MM, CHEAPEST, {"size": 1.0 * MM})
TIED = Mesh(0.5 * MM, TODAY)
MESHES = {
    "tied, 0.5 mm": TIED,
    "tied, 0.25 mm": replace(TIED, box=0.25 * MM),
    "imprinted": IMPRINTED,
    "imprinted, boxes shifted": replace(IMPRINTED, shift=0.5),
    "free-form, tied, 0.5 mm": replace(TIED, joint=CHEAPEST, swept=False),
    "free-form, imprinted": replace(IMPRINTED, swept=False),
}
