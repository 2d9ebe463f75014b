"""Which ranks carry which model and which cells, from speeds measured on this machine before models are distributed."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.data_file import write_at_once
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
from reflowshock.fem.problem.inputs import RunInput, StructureInput
from reflowshock.fem.problem.shock import Ranks
from reflowshock.fem.setup.models import Divided
from reflowshock.materials.roles import materials_of_parts

CALLS = 2.5e-5  # [s] of the interpreter in a step of a motion
KEPT = "speeds.json"
ALTERNATING: tuple[SchemeName, ...] = ("gravouil_combescure", "impulse")  # schemes whose models wait for each other


@dataclass(frozen=True, slots=True)
class ModelWork:
    """A model that is to be distributed.

    Attributes:
        mesh: Its mesh on rank 0, None on the others.
        level: ``(ne,)`` level of the step of each cell.
        rates: ``(levels,)`` steps of each level in a window.
        steps: Steps of its motion in a window.
        kind: What its elements are like.
    """

    mesh: MeshData | None
    level: NDArray[np.int32]
    rates: NDArray[np.int64]
    steps: int
    kind: Kind


@dataclass(frozen=True, slots=True)
class Plan:
    """Who does what.

    Attributes:
        placement: Ranks of each model.
        cells: Of each model on several ranks, the rank ``(ne,)`` of each cell in its communicator; on rank 0 only.
        summary: Prediction and measurements, for the result.
    """

    placement: Placement
    cells: Mapping[Role, NDArray[np.int32]]
    summary: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Measured:
    """Costs of this machine: of steps ``(ranks, 3)``, and of a message [s]."""

    cost: StepCost
    latency: float


def works_of(divided: Divided[Tables], request: RunInput | StructureInput) -> dict[Role, ModelWork]:
    """Return the models of a divided mesh as what is to be distributed."""
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
    """Measure, predict, choose, and say so; collective.

    Args:
        world: All ranks.
        loads: The models.
        ranks: What the input asks for.
        folder: Where a run keeps its checkpoints. Its measurement is kept there, too: a run that continues does so with
            the same cells on the same ranks, to the same bits.
        scheme: How two models are coupled.
    """
    family = {role: families(load.mesh, load.kind) for role, load in loads.items() if load.mesh}
    present = np.unique(np.concatenate([np.zeros(0, np.int8), *family.values()]))
    measured = kept(world, folder, present) or measure(world, loads, family)
    if folder is not None and world.rank == 0:
        keep(folder, measured)
    plan = plan_from(loads, family, ranks, (measured, scheme not in ALTERNATING)) if world.rank == 0 else None
    if plan:
        print(words(plan), flush=True)
    shared = world.bcast((plan.placement, plan.summary) if plan else None)
    return plan or Plan(shared[0], {}, shared[1])


def measure(world: MPI.Comm, loads: Mapping[Role, ModelWork], family: Mapping[Role, NDArray[np.int8]]) -> Measured:
    """Time each family of elements on a sample from the model that has most of it; collective."""
    found: dict[int, tuple[MeshData, MeshData, Kind]] = {}
    for role in sorted(family, key=lambda role: len(family[role])):
        load = loads[role]
        assert load.mesh is not None
        for number, pair in samples(load.mesh, family[role], world.size).items():
            if number not in found or len(pair[1].cells) > len(found[number][1].cells):
                found[number] = (*pair, load.kind)
    return Measured(measured_costs(world, world.bcast(found)), measured_latency(world))


def kept(world: MPI.Comm, folder: Path | None, present: NDArray[np.int8]) -> Measured | None:
    """Return what ``keep`` wrote with as many ranks of all families that rank 0 finds ``present``; collective."""
    found = None
    if world.rank == 0 and folder is not None and (folder / KEPT).exists():
        try:
            found = read(folder / KEPT, world.size, present)
        except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
            warn(f"{folder / KEPT} is broken, this machine is measured again: {type(error).__name__}: {error}")
    return world.bcast(found)


def read(path: Path, ranks: int, present: NDArray[np.int8]) -> Measured | None:
    """Return a measurement; None where it is of another number of ranks, or a family is missing."""
    record = json.loads(path.read_text())
    cost = StepCost(np.array(record["fixed"], float), np.array(record["element"], float))
    fits = len(cost.fixed) == ranks and bool((cost.element[:, present] > 0.0).all())
    return Measured(cost, float(record["latency"])) if fits else None


def keep(folder: Path, measured: Measured) -> None:
    """Write a measurement for a run that continues."""
    folder.mkdir(parents=True, exist_ok=True)
    cost = {"fixed": measured.cost.fixed.tolist(), "element": measured.cost.element.tolist()}
    write_at_once(folder / KEPT, json.dumps(cost | {"latency": measured.latency}).encode())


def plan_from(
    loads: Mapping[Role, ModelWork], family: Mapping[Role, NDArray[np.int8]], ranks: Ranks, known: tuple[Measured, bool]
) -> Plan:
    """Choose a placement, and the rank of each cell, from a measurement and from whether two models work at once."""
    measured, overlap = known
    cost, size = measured.cost, len(measured.cost.fixed)
    seconds = {role: rank_seconds(load, family[role], cost) for role, load in loads.items()}
    speeds = speeds_of(np.sum([work for work, _ in seconds.values()], axis=0))
    models = {
        role: ModelCost(float((work * speeds).mean()), float(fixed.mean()), int(loads[role].rates[used].sum()))
        for role, (work, fixed) in seconds.items()
        for used in [np.unique(loads[role].level)]
    }
    if "macro" in models:
        window = WindowCost(models["macro"], models["meso"], measured.latency, overlap)
        found = alternatives(ranks, speeds.tolist(), window)
    else:
        [(role, model)] = models.items()
        alone = shared((role,), size)
        found = [Alternative(alone, model_seconds(model, (speeds.sum(), size > 1), measured.latency))]
    chosen = found[0]
    cells = {
        role: partition(load.mesh, level_work(load, family[role], cost), speeds[list(chosen.placement.ranks[role])])
        for role, load in loads.items()
        if load.mesh is not None and len(chosen.placement.ranks[role]) > 1
    }
    return Plan(chosen.placement, cells, summary(ranks, found, speeds, measured))


def rank_seconds(
    load: ModelWork, family: NDArray[np.int8], cost: StepCost
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the seconds ``(ranks,)`` of a window that all elements of a model take, and those of calls."""
    rates, count = load.rates, len(FAMILIES)
    updates = np.bincount(family, weights=rates[load.level].astype(float), minlength=count)
    present = np.unique(np.column_stack([load.level, family]), axis=0)
    calls = np.bincount(present[:, 1], weights=rates[present[:, 0]].astype(float), minlength=count)
    return cost.element @ updates, cost.fixed @ calls + CALLS * load.steps


def level_work(load: ModelWork, family: NDArray[np.int8], cost: StepCost) -> NDArray[np.float64]:
    """Return the seconds ``(ne, levels)`` of a window that each element takes, in the column of its level."""
    work = np.zeros((len(family), len(load.rates)))
    work[np.arange(len(family)), load.level] = cost.element.mean(axis=0)[family] * load.rates[load.level]
    return work


def summary(ranks: Ranks, found: list[Alternative], speeds: NDArray[np.float64], measured: Measured) -> dict[str, Any]:
    """Return the choice and what it rests on."""
    mean = measured.cost.element.mean(axis=0)
    return {
        "asked": ranks.placement,
        "chosen": found[0].placement.words,
        "predicted_window_seconds": found[0].seconds,
        "alternatives": {item.placement.words: item.seconds for item in found},
        "speeds": speeds.tolist(),
        "update_seconds": {name: float(mean[k]) for k, name in enumerate(FAMILIES) if mean[k] > 0.0},
        "message_seconds": measured.latency,
    }


def words(plan: Plan) -> str:
    """Return one line on the choice, for people."""
    others = [
        f"{name} {1e3 * seconds:.3g} ms"
        for name, seconds in plan.summary["alternatives"].items()
        if name != plan.summary["chosen"]
    ]
    line = f"placement: {plan.summary['chosen']}, {1e3 * plan.summary['predicted_window_seconds']:.3g} ms a window"
    return f"{line} predicted" + (f"; {', '.join(others)}" if others else "")
