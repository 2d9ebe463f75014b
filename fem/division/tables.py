"""From a mesh to the tables of each model: the work of one rank before anything is distributed."""

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
from reflowshock.fem.mesh.column import with_columns
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
    """What every rank of a model knows about it, in input node and cell numbers.

    Attributes:
        part: ``(ne,)`` int32, index into ``part_names``.
        part_names: Names of the parts.
        tie: Slaves and masters.
        master_points: ``(ns, 4, 3)`` [m].
        moved: Largest move of a slave onto its facet [m].
        held_nodes: ``(k,)`` nodes with a held component.
        held: ``(k, 3)`` which components.
        interface: ``(nc,)`` nodes of the interface, in the same order on both sides.
        nodes: Number of nodes of the model.
        level: ``(ne,)`` int32 level of the step of each cell, 0 for the model's own step.
        ratios: Steps of level k + 1 in one of level k.
        every: ``(ne,)`` int32 in how many steps of the model each cell acts once, see ``path_levels``.
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
    def undivided(cls, whole: Whole, held: NDArray[np.bool_], **own: Any) -> Self:
        """Return the tables of a whole mesh as one model with one step.

        Args:
            whole: Mesh and ties.
            held: ``(n, 3)`` held components.
            own: Fields that a subclass adds.
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
            **own,
        )

    def counted(self, part: Part, node: NDArray[np.int32], cell: NDArray[np.int32]) -> dict[str, Any]:
        """Return the fields of a subclass with what counts in a model.

        Args:
            part: Of the mesh.
            node: ``(n,)`` its number of each node, -1 where the node counts in another model.
            cell: ``(ne,)`` the same of each cell.
        """
        return {}


@dataclass(frozen=True, slots=True)
class JointTables(Tables):
    """Tables of a package on a board.

    Attributes:
        watch: Its watch points.
        shaken: ``(k,)`` nodes of the mounting holes.
        interface: Where its joints meet the package.
        fitted: Watch points, gauges, supports and lumped masses of the board.
    """

    watch: WatchTable
    shaken: NDArray[np.int32]
    joint_interface: JointInterfaceTable
    fitted: FittedTable

    @classmethod
    def of(
        cls, whole: Whole, rules: Mapping[str, Sequence[int]], layer: float, given: FittedTable | None = None
    ) -> Self:
        """Find out what is held and watched.

        Args:
            whole: The mesh.
            rules: What is held, as ``HELD``.
            layer: Thickness of the solder at the pads over which stress is averaged [m].
            given: What is fitted to the board, if anything is.
        """
        mesh = whole.mesh
        return cls.undivided(
            whole,
            held_components(mesh, rules),
            watch=whole_watch(mesh, layer),
            shaken=mesh.facet_nodes("mounting_holes"),
            joint_interface=whole_joint_interface(mesh),
            fitted=given or fitted(mesh, Fittings(), (), whole.tie.slave, yields=False),
        )

    def counted(self, part: Part, node: NDArray[np.int32], cell: NDArray[np.int32]) -> dict[str, Any]:
        """Return watch points, shaken nodes, interfaces of joints, and what is fitted to the board."""
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
    """One model before it is distributed: its mesh, its tables, its cells ``(k,)`` in numbers of the whole mesh."""

    mesh: MeshData
    tables: TablesT_co
    cells: NDArray[np.intp]


def joined(data: MeshData) -> Whole:
    """Let board and patch share their nodes, give columns their place, and tie the joints.

    Raises:
        CouplingError, MeshError, TieError: They do not fit.
    """
    macro_nodes, meso_nodes = find_interface(data)
    return Whole(*tie_joints(with_columns(merge_nodes(data, meso_nodes, macro_nodes)[0])))


def prepare(
    data: MeshData, division: Division | Literal["dns"], rules: Mapping[str, Sequence[int]] = HELD
) -> dict[Role, ModelInput[JointTables]]:
    """Join a mesh and return its models, as ``model_inputs``."""
    return model_inputs(joined(data), division, rules)


def model_inputs(
    whole: Whole,
    division: Division | Literal["dns"],
    rules: Mapping[str, Sequence[int]] = HELD,
    layer: float = JOINT_LAYER,
    given: FittedTable | None = None,
) -> dict[Role, ModelInput[JointTables]]:
    """Split a package on a board into its models; arguments as ``JointTables.of``.

    Returns:
        ``macro`` and ``meso``, or ``dns``: all of it.

    Raises:
        MeshError: A pad has no solder, or the layer is thicker than a joint.
    """
    tables = JointTables.of(whole, rules, layer, given)
    if division != "dns":
        return split(whole, tables, division)
    part = part_of(whole, np.ones(len(whole.mesh.cells), dtype=bool))
    return {"dns": part_input(whole, tables, part, (part.number, part.cell_number))}


def split(whole: Whole, tables: TablesT, division: Division) -> dict[Role, ModelInput[TablesT]]:
    """Split a mesh with its tables into the models ``macro`` and ``meso``; what both have counts in the macro model."""
    macro, meso = part_of(whole, division.macro), part_of(whole, division.meso)
    interface = interface_between(whole, part_of(whole, division.around), meso)
    rest = np.where(macro.number < 0, meso.number, -1), np.where(macro.cell_number < 0, meso.cell_number, -1)
    coarse = part_input(whole, tables, macro, (macro.number, macro.cell_number))
    fine = part_input(whole, tables, meso, rest)
    coarse_tables = replace(coarse.tables, interface=macro.number[interface])
    fine_tables = replace(fine.tables, interface=meso.number[interface], every=division.every[division.meso])
    if division.local:
        fine_tables = replace(fine_tables, level=division.level[division.meso], ratios=division.ratios)
    return {"macro": replace(coarse, tables=coarse_tables), "meso": replace(fine, tables=fine_tables)}


def part_input(
    whole: Whole, tables: TablesT, part: Part, counted: tuple[NDArray[np.int32], NDArray[np.int32]]
) -> ModelInput[TablesT]:
    """Return a part of a mesh as a model without an interface.

    Args:
        whole: The mesh.
        tables: Its tables.
        part: The part.
        counted: Own numbers of the nodes ``(n,)`` and cells ``(ne,)`` that are loaded and watched in this model, -1 for
            those of another one.
    """
    mine = np.flatnonzero(part.number >= 0)
    order = mine[np.argsort(part.number[mine])]
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
        **tables.counted(part, *counted),
    )
    return ModelInput(part.mesh, restricted, np.flatnonzero(part.cell_number >= 0))


def present(numbers: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the numbers that are none of another model's."""
    return numbers[numbers >= 0]
