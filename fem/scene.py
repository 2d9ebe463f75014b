"""From mesh files to the tables of each model: the work of one rank before anything is distributed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fem.cut import MACRO, check_buffer, find_cut
from fem.errors import MeshError
from fem.mesh import MeshData, merge_nodes, select
from fem.supports import HELD, held_components
from fem.tie import Tie, tie_joints
from fem.watch_table import WatchTable, centre_nodes, footprint, joint_names, watch_table


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
        cut: ``(nc,)`` nodes of the cut, in the same order on both sides.
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
    cut: NDArray[np.int32]
    nodes: int
    level: NDArray[np.int32]
    ratios: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class JointTables(Tables):
    """Tables of a package on a board.

    Attributes:
        watch: Its watch points.
        shaken: ``(k,)`` nodes of the mounting holes.
    """

    watch: WatchTable
    shaken: NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class ModelInput:
    """One model before it is distributed: its mesh and its tables."""

    mesh: MeshData
    tables: JointTables


def prepare(
    data: MeshData, mode: Literal["two_scale", "dns"], rules: Mapping[str, Sequence[int]] = HELD
) -> dict[str, ModelInput]:
    """Split a mesh into the models of a mode; ``rules`` say what is held, as ``supports.HELD``.

    Returns:
        ``macro`` and ``meso``, or ``dns``.

    Raises:
        MeshError, TieError, CutError: The mesh does not fit.
    """
    macro_nodes, meso_nodes = find_cut(data)
    if mode == "dns":
        merged, number = merge_nodes(data, meso_nodes, macro_nodes)
        return {"dns": model_input(merged, number[macro_nodes], watch_scene(merged), centre_nodes(merged), rules)}
    if not len(macro_nodes):
        raise MeshError(f"two_scale needs the parts {MACRO} and board_patch; the mesh has {', '.join(data.part_names)}")
    scene, centres = watch_scene(data), centre_nodes(data)
    macro, macro_number = select(data, MACRO.__eq__)
    meso, meso_number = select(data, MACRO.__ne__)
    macro_centres = np.where(centres >= 0, macro_number[centres], -1)
    meso_centres = np.where((centres >= 0) & (macro_centres < 0), meso_number[centres], -1)
    result = {
        "macro": model_input(macro, macro_number[macro_nodes], scene, macro_centres, rules),
        "meso": model_input(meso, meso_number[meso_nodes], scene, meso_centres, rules),
    }
    tables = result["meso"].tables
    check_buffer(meso, tables.cut, np.unique(tables.tie.master, axis=0))
    return result


def watch_scene(data: MeshData) -> tuple[tuple[str, ...], NDArray[np.float64]]:
    """Return what all models watch alike: joint names, and the footprint ``(2, 2)`` [m]."""
    return joint_names(data), footprint(data)


def model_input(
    mesh: MeshData,
    cut: NDArray[np.int32],
    scene: tuple[tuple[str, ...], NDArray[np.float64]],
    centres: NDArray[np.integer],
    rules: Mapping[str, Sequence[int]],
) -> ModelInput:
    """Build the tables of one model: tie, supports, watch points."""
    mesh, tie, moved = tie_joints(mesh)
    held = held_components(mesh, rules)
    held_nodes = np.flatnonzero(held.any(axis=1))
    tables = JointTables(
        part=mesh.part,
        part_names=mesh.part_names,
        tie=tie,
        master_points=mesh.points[tie.master],
        moved=moved,
        held_nodes=held_nodes,
        held=held[held_nodes],
        cut=cut,
        watch=watch_table(mesh, *scene, centres),
        shaken=mesh.facet_nodes("mounting_holes"),
        nodes=len(mesh.points),
        level=np.zeros(len(mesh.cells), np.int32),
        ratios=(),
    )
    return ModelInput(mesh, tables)
