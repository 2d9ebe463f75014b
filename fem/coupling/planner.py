"""Which ranks carry which model and which cells, from speeds measured on this machine before models are distributed."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.data_file import write_atomically
from reflowshock.fem.coupling.speeds import (
    FAMILIES,
    Kind,
    StepCost,
    families,
    measured_costs,
    measured_latency,
    samples,
    speeds_of,
)
from reflowshock.fem.division.division import SchemeName
from reflowshock.fem.division.tables import Tables
from reflowshock.fem.estimates.placement import (
    Alternative,
    ModelCost,
    Placement,
    Role,
    WindowCost,
    alternatives,
    model_seconds,
    shared,
)
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.parallel.checkpoint_files import warn
from reflowshock.fem.parallel.partition import partition
from reflowshock.fem.parallel.waiting import wait_for_all
from reflowshock.fem.problem.inputs import RunInput, StructureInput
from reflowshock.fem.problem.shock import Ranks
from reflowshock.fem.setup.models import DividedModels
from reflowshock.materials.roles import materials_of_parts

CALLS = 2.5e-5  # [s] of the interpreter in a step of a motion
COST_FILE = "speeds.json"
ALTERNATING: tuple[SchemeName, ...] = ("gravouil_combescure", "impulse")  # schemes whose models wait for each other


@dataclass(frozen=True, slots=True)
class ModelWork:
    """Model to be distributed.

    Attributes:
        mesh: Mesh on rank 0, None on other ranks.
        level: Step level of each cell, shape (ne,).
        rates: Steps of each level in a window, shape (levels,).
        steps: Steps of the model's motion in a window.
        kind: Materials, formulation, kinematics and step of the elements.
    """

    mesh: MeshData | None
    level: NDArray[np.int32]
    rates: NDArray[np.int64]
    steps: int
    kind: Kind


@dataclass(frozen=True, slots=True)
class Plan:
    """Assignment of models and cells to ranks.

    Attributes:
        placement: Ranks of each model.
        cells: Rank of each cell in the communicator of its model, shape (ne,), for models on several ranks; on rank 0.
        summary: Prediction and measurements for the result file.
    """

    placement: Placement
    cells: Mapping[Role, NDArray[np.int32]]
    summary: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Measured:
    """Measured costs of this machine: steps of each element family on each rank, and a message [s]."""

    cost: StepCost
    latency: float


def works_of(divided: DividedModels[Tables], request: RunInput | StructureInput) -> dict[Role, ModelWork]:
    """Return the work of each model of a divided mesh: its mesh, steps of each cell in a window, and kind of elements.

    Args:
        divided: Models before distribution, with their meshes on rank 0.
        request: Input of the run, with materials, formulation and kinematics.

    Returns:
        Role of the model -> its mesh (on rank 0), step level of each cell, steps of each level in a window (the time
        between two exchanges of the models), and how its elements are computed.
    """
    works: dict[Role, ModelWork] = {}
    for role, tables in divided.tables.items():
        _, assigned = materials_of_parts(tables.part_names, request.part_materials)
        step = divided.steps.step_of(role)
        kind = Kind(assigned, request.formulation, request.kinematics, step)
        steps = round(divided.steps.plan.window / step)
        paces, level = np.unique(tables.every, return_inverse=True)
        rates = steps // paces
        if len(paces) == 1:
            level, rates = tables.level, steps * np.cumprod([1, *tables.ratios])
        works[role] = ModelWork(divided.meshes.get(role), level, rates, steps, kind)
    return works


def plan_ranks(
    world: MPI.Comm,
    loads: Mapping[Role, ModelWork],
    ranks: Ranks,
    folder: Path | None,
    scheme: SchemeName = "held_velocity",
) -> Plan:
    """Choose the placement from measured costs, and print it; collective.

    Args:
        world: Communicator of all ranks.
        loads: Work of each model.
        ranks: Placement settings of the input.
        folder: Checkpoint folder. The measurement is read from it and written to it, so that a restart has the same
            cells on the same ranks and identical results. None measures without storing.
        scheme: Coupling scheme, which decides whether both models can work concurrently.

    Returns:
        Ranks of each model, rank of each cell (on rank 0 only), and the summary for the result file.
    """
    family = {role: families(load.mesh, load.kind) for role, load in loads.items() if load.mesh}
    present = np.unique(np.concatenate([np.zeros(0, np.int8), *family.values()]))
    measured = stored_costs(world, folder, present) or _measure(world, loads, family)
    if folder is not None and world.rank == 0:
        store_costs(folder, measured)
    overlap = scheme not in ALTERNATING
    plan = plan_from(loads, family, ranks, measured, overlap) if world.rank == 0 else None
    if plan:
        print(words(plan), flush=True)
    wait_for_all(world)
    shared = world.bcast((plan.placement, plan.summary) if plan else None)
    return plan or Plan(shared[0], {}, shared[1])


def _measure(world: MPI.Comm, loads: Mapping[Role, ModelWork], family: Mapping[Role, NDArray[np.int8]]) -> Measured:
    """Measure the cost of each element family on a sample from the model with most of its elements; collective."""
    chosen: dict[int, tuple[MeshData, MeshData, Kind]] = {}
    for role in sorted(family, key=lambda role: len(family[role])):
        load = loads[role]
        assert load.mesh is not None
        for number, pair in samples(load.mesh, family[role], world.size).items():
            if number not in chosen or len(pair[1].cells) > len(chosen[number][1].cells):
                chosen[number] = (*pair, load.kind)
    return Measured(measured_costs(world, world.bcast(chosen)), measured_latency(world))


def stored_costs(world: MPI.Comm, folder: Path | None, present: NDArray[np.int8]) -> Measured | None:
    """Return the stored costs of element families and messages, equal on all ranks; collective.

    Args:
        world: Communicator of all ranks.
        folder: Folder of the file, read on rank 0; may be None.
        present: Element families in the meshes, indices into ``FAMILIES``, shape (k,).

    Returns:
        Costs; None if there is no folder or file, if the file is damaged (with a warning), or if it does not cover this
        number of ranks and these families.
    """
    costs = None
    if world.rank == 0 and folder is not None and (folder / COST_FILE).exists():
        try:
            costs = _read(folder / COST_FILE, world.size, present)
        except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
            warn(f"{folder / COST_FILE} is damaged, costs are measured again: {type(error).__name__}: {error}")
    return world.bcast(costs)


def _read(path: Path, ranks: int, present: NDArray[np.int8]) -> Measured | None:
    """Read measured costs; return None for another number of ranks or a missing element family."""
    record = json.loads(path.read_text())
    cost = StepCost(np.array(record["fixed"], float), np.array(record["element"], float))
    fits = len(cost.fixed) == ranks and bool((cost.element[:, present] > 0.0).all())
    return Measured(cost, float(record["latency"])) if fits else None


def store_costs(folder: Path, measured: Measured) -> None:
    """Write measured costs as a JSON file for a restart; not collective.

    Args:
        folder: Checkpoint folder, created if missing.
        measured: Fixed time and time per element of each family on each rank, and the time of a message [s].
    """
    folder.mkdir(parents=True, exist_ok=True)
    cost = {"fixed": measured.cost.fixed.tolist(), "element": measured.cost.element.tolist()}
    write_atomically(folder / COST_FILE, json.dumps(cost | {"latency": measured.latency}).encode())


def plan_from(
    loads: Mapping[Role, ModelWork],
    family: Mapping[Role, NDArray[np.int8]],
    ranks: Ranks,
    measured: Measured,
    overlap: bool,
) -> Plan:
    """Choose the placement and the rank of each cell from measured costs; not collective.

    Args:
        loads: Work of each model, with meshes.
        family: Index into ``FAMILIES`` of each cell of each model, shape (ne,).
        ranks: Placement settings of the input.
        measured: Measured costs of this machine.
        overlap: Whether both models work concurrently.

    Returns:
        Ranks of each model, rank of each cell of models on several ranks, and the summary for the result file.
    """
    cost, size = measured.cost, len(measured.cost.fixed)
    seconds = {role: _rank_seconds(load, family[role], cost) for role, load in loads.items()}
    speeds = speeds_of(np.sum([work for work, _ in seconds.values()], axis=0))
    models = {
        role: ModelCost(float((work * speeds).mean()), float(fixed.mean()), int(loads[role].rates[used].sum()))
        for role, (work, fixed) in seconds.items()
        for used in [np.unique(loads[role].level)]
    }
    if "macro" in models:
        window = WindowCost(models["macro"], models["meso"], measured.latency, overlap)
        placements = alternatives(ranks, speeds.tolist(), window)
    else:
        [(role, model)] = models.items()
        alone = shared((role,), size)
        placements = [Alternative(alone, model_seconds(model, speeds.sum(), size > 1, measured.latency))]
    chosen = placements[0]
    cells = {
        role: partition(load.mesh, _level_work(load, family[role], cost), speeds[list(chosen.placement.ranks[role])])
        for role, load in loads.items()
        if load.mesh is not None and len(chosen.placement.ranks[role]) > 1
    }
    return Plan(chosen.placement, cells, summary(ranks, placements, speeds, measured))


def _rank_seconds(
    load: ModelWork, family: NDArray[np.int8], cost: StepCost
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the time per window of all elements of a model, and of its calls, each of shape (ranks,) [s]."""
    rates, count = load.rates, len(FAMILIES)
    updates = np.bincount(family, weights=rates[load.level].astype(float), minlength=count)
    present = np.unique(np.column_stack([load.level, family]), axis=0)
    calls = np.bincount(present[:, 1], weights=rates[present[:, 0]].astype(float), minlength=count)
    return cost.element @ updates, cost.fixed @ calls + CALLS * load.steps


def _level_work(load: ModelWork, family: NDArray[np.int8], cost: StepCost) -> NDArray[np.float64]:
    """Return the time per window of each element in the column of its level, shape (ne, levels) [s]."""
    work = np.zeros((len(family), len(load.rates)))
    work[np.arange(len(family)), load.level] = cost.element.mean(axis=0)[family] * load.rates[load.level]
    return work


def summary(
    ranks: Ranks, placements: list[Alternative], speeds: NDArray[np.float64], measured: Measured
) -> dict[str, Any]:
    """Return the chosen placement with predictions and measurements, for ``result.json``.

    Args:
        ranks: Placement settings of the input.
        placements: Admissible placements with the predicted time of a window [s], the fastest first; it is chosen.
        speeds: Relative speed of each rank, shape (ranks,).
        measured: Measured costs.

    Returns:
        ``asked`` and ``chosen`` (names of placements), ``predicted_window_seconds``, ``alternatives`` (name ->
        predicted time of a window [s]), ``speeds`` (list), ``update_seconds`` (element family -> mean time per
        element [s]) and ``message_seconds`` (time of one message).
    """
    mean = measured.cost.element.mean(axis=0)
    return {
        "asked": ranks.placement,
        "chosen": placements[0].placement.words,
        "predicted_window_seconds": placements[0].seconds,
        "alternatives": {item.placement.words: item.seconds for item in placements},
        "speeds": speeds.tolist(),
        "update_seconds": {name: float(mean[k]) for k, name in enumerate(FAMILIES) if mean[k] > 0.0},
        "message_seconds": measured.latency,
    }


def words(plan: Plan) -> str:
    """Return the placement and its predicted window time [ms], with those of the alternatives, as one line of text.

    Args:
        plan: Assignment whose ``summary`` has the keys of the function ``summary``.
    """
    others = [
        f"{name} {1e3 * seconds:.3g} ms"
        for name, seconds in plan.summary["alternatives"].items()
        if name != plan.summary["chosen"]
    ]
    line = f"placement: {plan.summary['chosen']}, {1e3 * plan.summary['predicted_window_seconds']:.3g} ms per window"
    return f"{line} predicted" + (f"; {', '.join(others)}" if others else "")
