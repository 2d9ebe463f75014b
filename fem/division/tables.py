"""Tables of each model from a mesh, computed on one rank before distribution."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, Literal, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.division import Division
from reflowshock.fem.division.fitted import FittedTable, fitted
from reflowshock.fem.division.split import Part, interface_between, part_of
from reflowshock.fem.division.whole import Whole
from reflowshock.fem.estimates.placement import Role
from reflowshock.fem.mesh.column import insert_columns
from reflowshock.fem.mesh.coupling_interface import find_interface
from reflowshock.fem.mesh.joint_interface import JointInterfaceTable, whole_joint_interface
from reflowshock.fem.mesh.mesh import MeshData, merge_nodes
from reflowshock.fem.mesh.supports import HELD, held_components
from reflowshock.fem.mesh.tie import Tie, tie_joints
from reflowshock.fem.mesh.watch_table import WatchTable, whole_watch
from reflowshock.fem.problem.fittings import Fittings
from reflowshock.fem.problem.shock import JOINT_LAYER


@dataclass(frozen=True, slots=True)
class Tables:
    """Tables of a model that every rank has, in input node and cell numbers.

    Attributes:
        part: Part of each cell as an index into ``part_names``, shape (ne,) int32.
        part_names: Names of the parts.
        tie: Slaves and masters.
        master_points: Positions of the masters of each slave, shape (ns, 4, 3) [m].
        moved: Largest displacement of a slave onto its master facet [m].
        held_nodes: Nodes with a fixed component, shape (k,).
        held: Whether each component of these nodes is fixed, shape (k, 3).
        interface: Interface nodes in the same order in both models, shape (nc,).
        nodes: Number of nodes of the model.
        level: Step level of each cell, 0 for the step of the model, shape (ne,) int32.
        ratios: Steps of level k + 1 in one step of level k.
        every: Pace of each cell, the number of steps in which it acts once (``path_levels``), shape (ne,) int32.
    """

    part: NDArray[np.int32]
    part_names: tuple[str, ...]
    tie: Tie
    master_points: NDArray[np.float64]
    moved: float
    held_nodes: NDArray[np.int64]
    held: NDArray[np.bool_]
    interface: NDArray[np.int32]
    nodes: int
    level: NDArray[np.int32]
    ratios: tuple[int, ...]
    every: NDArray[np.int32]

    @classmethod
    def undivided(cls, whole: Whole, held: NDArray[np.bool_], **fields: Any) -> Self:
        """Return the tables of a joined mesh as one model with one step.

        Args:
            whole: Mesh and ties.
            held: Fixed components, shape (n, 3).
            fields: Fields that a subclass adds.
        """
        held_nodes = np.flatnonzero(held.any(axis=1))
        return cls(
            part=whole.mesh.part,
            part_names=whole.mesh.part_names,
            tie=whole.tie,
            master_points=whole.mesh.points[whole.tie.master],
            moved=whole.moved,
            held_nodes=held_nodes,
            held=held[held_nodes],
            interface=np.empty(0, np.int32),
            nodes=len(whole.mesh.points),
            level=np.zeros(len(whole.mesh.cells), np.int32),
            ratios=(),
            every=np.ones(len(whole.mesh.cells), np.int32),
            **fields,
        )

    def restricted(self, part: Part, node: NDArray[np.int32], cell: NDArray[np.int32]) -> dict[str, Any]:
        """Return the fields of a subclass restricted to one model.

        Args:
            part: Part of the mesh that belongs to the model.
            node: Number of each node in the model, -1 if it counts in another model, shape (n,).
            cell: Number of each cell in the model, -1 if it counts in another model, shape (ne,).
        """
        return {}


@dataclass(frozen=True, slots=True)
class JointTables(Tables):
    """Tables of a package on a board.

    Attributes:
        watch: Watch points of joints, centres and board strain.
        shaken: Nodes of the mounting holes, shape (k,).
        joint_interface: Upper interfaces of the joints.
        fitted: Watch points, gauges, supports and lumped masses of the board.
    """

    watch: WatchTable
    shaken: NDArray[np.int32]
    joint_interface: JointInterfaceTable
    fitted: FittedTable

    @classmethod
    def of(
        cls, whole: Whole, rules: Mapping[str, Sequence[int]], layer: float, fittings: FittedTable | None = None
    ) -> Self:
        """Return the tables of a package on a board.

        Args:
            whole: Joined mesh.
            rules: Fixed components by facet set, as in ``HELD``.
            layer: Thickness of the solder layer at the pads over which stress is averaged [m].
            fittings: Fittings of the board, None without fittings.
        """
        mesh = whole.mesh
        return cls.undivided(
            whole,
            held_components(mesh, rules),
            watch=whole_watch(mesh, layer),
            shaken=mesh.facet_nodes("mounting_holes"),
            joint_interface=whole_joint_interface(mesh),
            fitted=fittings or fitted(mesh, Fittings(), (), whole.tie.slave, yields=False),
        )

    def restricted(self, part: Part, node: NDArray[np.int32], cell: NDArray[np.int32]) -> dict[str, Any]:
        """Return watch points, shaken nodes, joint interfaces and fittings in the numbers of a model."""
        return {
            "watch": self.watch.within(node, cell, part.number),
            "shaken": present(node[self.shaken]),
            "joint_interface": self.joint_interface.within(cell),
            "fitted": self.fitted.within(node, cell, part.number),
        }


TablesT = TypeVar("TablesT", bound=Tables)
TablesT_co = TypeVar("TablesT_co", bound=Tables, covariant=True)


@dataclass(frozen=True, slots=True)
class ModelInput(Generic[TablesT_co]):
    """One model before distribution: mesh, tables, and its cells in numbers of the joined mesh, shape (k,)."""

    mesh: MeshData
    tables: TablesT_co
    cells: NDArray[np.intp]


def join_meshes(data: MeshData) -> Whole:
    """Merge the nodes of board and board patch, insert the columns of fine joints, and tie the joints.

    Args:
        data: Mesh of board, board patch, package and joints without common nodes.

    Returns:
        Mesh with the ties of its slaves, which were moved onto their facets, and the largest such move [m].

    Raises:
        CouplingError: A node of the patch has no partner in the board.
        MeshError: A column does not fit into the boxes that it replaces.
        TieError: The end of a joint does not lie on board or package.
    """
    macro_nodes, meso_nodes = find_interface(data)
    return Whole(*tie_joints(insert_columns(merge_nodes(data, meso_nodes, macro_nodes)[0])))


def prepare(
    data: MeshData, division: Division | Literal["dns"], rules: Mapping[str, Sequence[int]] = HELD
) -> dict[Role, ModelInput[JointTables]]:
    """Join the meshes of a package on a board and split them into models, without fittings.

    Args:
        data: Mesh of board, board patch, package and joints without common nodes.
        division: Cells of each model, or "dns" for one model without scales.
        rules: Facet set -> its fixed components (0, 1, 2 for x, y, z).

    Returns:
        Mesh and tables of the models ``macro`` and ``meso``, or of the single model ``dns``.

    Raises:
        CouplingError, MeshError, TieError: The parts of the mesh do not fit together, or a pad has no solder.
    """
    return model_inputs(join_meshes(data), division, rules)


def model_inputs(
    whole: Whole,
    division: Division | Literal["dns"],
    rules: Mapping[str, Sequence[int]] = HELD,
    layer: float = JOINT_LAYER,
    fittings: FittedTable | None = None,
) -> dict[Role, ModelInput[JointTables]]:
    """Split a package on a board into its models.

    Args:
        whole: Joined mesh with its ties.
        division: Cells of each model, or "dns" for one model without scales.
        rules: Facet set -> its fixed components (0, 1, 2 for x, y, z).
        layer: Thickness of the solder layer at the pads over which stress is averaged [m].
        fittings: Supports, masses, watch points and gauges of the board; None without them.

    Returns:
        Mesh and tables of the models ``macro`` and ``meso``, or of the single model ``dns``.

    Raises:
        MeshError: A pad has no solder, or the layer is thicker than a joint.
    """
    tables = JointTables.of(whole, rules, layer, fittings)
    if division != "dns":
        return split(whole, tables, division)
    part = part_of(whole, np.ones(len(whole.mesh.cells), dtype=bool))
    return {"dns": _part_input(whole, tables, part, part.number, part.cell_number)}


def split(whole: Whole, tables: TablesT, division: Division) -> dict[Role, ModelInput[TablesT]]:
    """Split a mesh with its tables into the models ``macro`` and ``meso``.

    Nodes and cells in both models are loaded and watched in the macro model only.

    Args:
        whole: Joined mesh with its ties.
        tables: Loads, supports and watch points in the numbers of this mesh.
        division: Cells of each model.

    Returns:
        For each model its mesh, its tables in its own node and cell numbers, and the numbers of its cells in ``whole``.
    """
    macro, meso = part_of(whole, division.macro), part_of(whole, division.meso)
    interface = interface_between(whole, part_of(whole, division.around), meso)
    rest = np.where(macro.number < 0, meso.number, -1), np.where(macro.cell_number < 0, meso.cell_number, -1)
    coarse = _part_input(whole, tables, macro, macro.number, macro.cell_number)
    fine = _part_input(whole, tables, meso, *rest)
    coarse_tables = replace(coarse.tables, interface=macro.number[interface])
    fine_tables = replace(fine.tables, interface=meso.number[interface], every=division.every[division.meso])
    if division.local:
        fine_tables = replace(fine_tables, level=division.level[division.meso], ratios=division.ratios)
    return {"macro": replace(coarse, tables=coarse_tables), "meso": replace(fine, tables=fine_tables)}


def _part_input(
    whole: Whole, tables: TablesT, part: Part, node: NDArray[np.int32], cell: NDArray[np.int32]
) -> ModelInput[TablesT]:
    """Return a part of a mesh as a model without an interface.

    Args:
        whole: Joined mesh.
        tables: Tables of the joined mesh.
        part: Part of the mesh.
        node: Number in the part of each node that is loaded and watched in this model, otherwise -1, shape (n,).
        cell: Number in the part of each cell that is loaded and watched in this model, otherwise -1, shape (ne,).
    """
    in_part = np.flatnonzero(part.number >= 0)
    order = in_part[np.argsort(part.number[in_part])]
    held = part.number[tables.held_nodes].astype(np.int64)
    restricted = replace(
        tables,
        part=part.mesh.part,
        part_names=part.mesh.part_names,
        tie=part.tie,
        master_points=whole.mesh.points[order][part.tie.master],
        held_nodes=held[held >= 0],
        held=tables.held[held >= 0],
        nodes=part.nodes,
        level=np.zeros(len(part.mesh.cells), np.int32),
        every=np.ones(len(part.mesh.cells), np.int32),
        **tables.restricted(part, node, cell),
    )
    return ModelInput(part.mesh, restricted, np.flatnonzero(part.cell_number >= 0))


def present(numbers: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the non-negative ones of some node or cell numbers, shape (m,), in the same order.

    Args:
        numbers: Numbers in this model, -1 for nodes or cells of other models, shape (k,).
    """
    return numbers[numbers >= 0]
