"""From a mesh to the tables of each model: the work of one rank before anything is distributed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, Literal, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.division import Division
from reflowshock.fem.division.split import Part, interface_between, part_of
from reflowshock.fem.division.whole import Whole
from reflowshock.fem.estimates.placement import Role
from reflowshock.fem.mesh.coupling_interface import find_interface
from reflowshock.fem.mesh.joint_interface import JointInterfaceTable, whole_joint_interface
from reflowshock.fem.mesh.mesh import MeshData, merge_nodes
from reflowshock.fem.mesh.supports import HELD, held_components
from reflowshock.fem.mesh.tie import Tie, tie_joints
from reflowshock.fem.mesh.watch_table import WatchTable, whole_watch


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
            **own,
        )


@dataclass(frozen=True, slots=True)
class JointTables(Tables):
    """Tables of a package on a board.

    Attributes:
        watch: Its watch points.
        shaken: ``(k,)`` nodes of the mounting holes.
        interface: Where its joints meet the package.
    """

    watch: WatchTable
    shaken: NDArray[np.int32]
    joint_interface: JointInterfaceTable


TablesT_co = TypeVar("TablesT_co", bound=Tables, covariant=True)


@dataclass(frozen=True, slots=True)
class ModelInput(Generic[TablesT_co]):
    """One model before it is distributed: its mesh, its tables, its cells ``(k,)`` in numbers of the whole mesh."""

    mesh: MeshData
    tables: TablesT_co
    cells: NDArray[np.intp]


def joined(data: MeshData) -> Whole:
    """Let board and patch share their nodes, and tie the joints.

    Raises:
        CouplingError, TieError: They do not fit.
    """
    macro_nodes, meso_nodes = find_interface(data)
    return Whole(*tie_joints(merge_nodes(data, meso_nodes, macro_nodes)[0]))


def prepare(
    data: MeshData, division: Division | Literal["dns"], rules: Mapping[str, Sequence[int]] = HELD
) -> dict[Role, ModelInput[JointTables]]:
    """Join a mesh and return its models, as ``model_inputs``."""
    return model_inputs(joined(data), division, rules)


def model_inputs(
    whole: Whole, division: Division | Literal["dns"], rules: Mapping[str, Sequence[int]] = HELD
) -> dict[Role, ModelInput[JointTables]]:
    """Split a mesh into its models; ``rules`` say what is held, as ``supports.HELD``.

    Returns:
        ``macro`` and ``meso``, or ``dns``: all of it.

    Raises:
        MeshError: A pad has no solder.
    """
    package = WholePackage.of(whole, rules)
    if division == "dns":
        part = part_of(whole, np.ones(len(whole.mesh.cells), dtype=bool))
        return {"dns": package.model_input(part, np.empty(0, np.int32), (part.number, part.cell_number))}
    macro, meso = part_of(whole, division.macro), part_of(whole, division.meso)
    interface = interface_between(whole, part_of(whole, division.around), meso)
    rest = np.where(macro.number < 0, meso.number, -1), np.where(macro.cell_number < 0, meso.cell_number, -1)
    inputs: dict[Role, ModelInput[JointTables]] = {
        "macro": package.model_input(macro, interface, (macro.number, macro.cell_number)),
        "meso": package.model_input(meso, interface, rest),
    }
    tables = replace(inputs["meso"].tables, level=division.level[division.meso], ratios=division.ratios)
    return inputs | {"meso": replace(inputs["meso"], tables=tables)}


@dataclass(frozen=True, slots=True)
class WholePackage:
    """What is known of a package on a board before it is split: mesh and ties, held components ``(n, 3)``, watches."""

    whole: Whole
    held: NDArray[np.bool_]
    watch: WatchTable
    joint_interface: JointInterfaceTable

    @classmethod
    def of(cls, whole: Whole, rules: Mapping[str, Sequence[int]]) -> "WholePackage":
        """Find out what is held and watched."""
        mesh = whole.mesh
        return cls(whole, held_components(mesh, rules), whole_watch(mesh), whole_joint_interface(mesh))

    def model_input(
        self, part: Part, interface: NDArray[np.integer], counted: tuple[NDArray[np.int32], NDArray[np.int32]]
    ) -> ModelInput[JointTables]:
        """Return a model with its tables.

        Args:
            part: Its part of the mesh.
            interface: ``(nc,)`` nodes of the whole mesh that couple.
            counted: Own numbers of the nodes ``(n,)`` and cells ``(ne,)`` that are watched and shaken in this model, -1
                for those of another one.
        """
        mine = np.flatnonzero(part.number >= 0)
        order = mine[np.argsort(part.number[mine])]
        held_nodes = np.flatnonzero(self.held[order].any(axis=1))
        shaken = counted[0][self.whole.mesh.facet_nodes("mounting_holes")]
        tables = JointTables(
            part=part.mesh.part,
            part_names=part.mesh.part_names,
            tie=part.tie,
            master_points=self.whole.mesh.points[order][part.tie.master],
            moved=self.whole.moved,
            held_nodes=held_nodes,
            held=self.held[order][held_nodes],
            interface=part.number[interface],
            nodes=part.nodes,
            level=np.zeros(len(part.mesh.cells), np.int32),
            ratios=(),
            watch=self.watch.within(*counted),
            shaken=shaken[shaken >= 0],
            joint_interface=self.joint_interface.within(counted[1]),
        )
        return ModelInput(part.mesh, tables, np.flatnonzero(part.cell_number >= 0))
