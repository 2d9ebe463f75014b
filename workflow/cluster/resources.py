"""What the job of each stage asks a cluster for: ranks, cores, memory, time; as `plan` foresees, with a margin."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from typing import Any

from reflowshock.workflow.board_drop.case import PackageCase
from reflowshock.workflow.case.kind import Case
from reflowshock.workflow.pipeline.reader import available_cores
from reflowshock.workflow.structure.case import StructureCase

# Short and serial: they run beside the command, not as jobs.
WITH_COMMAND = ("comparison", "report")
MOST_CORES = 16  # of a reflow by processes, which share a machine
MEGABYTES, MEGABYTES_OF_PROCESS = 1500, 500  # interpreter, Snakemake, libraries
BYTES_OF_ELEMENT, BYTES_OF_PARTICLE = 5.0e3, 5.0e4
MINUTES, MARGIN = 10, 3.0  # of the walltime: to start and compile, over the forecast


@dataclass(frozen=True, slots=True)
class Resources:
    """What a job asks for.

    Attributes:
        tasks: MPI ranks.
        cpus_per_task: cores of each.
        mem_mb: memory on each node [MB].
        runtime: walltime [min].
    """

    tasks: int
    cpus_per_task: int
    mem_mb: int
    runtime: int

    def of_rule(self, launcher: str) -> dict[str, int | str]:
        """Return the resources as Snakemake knows them.

        Args:
            launcher: what starts MPI ranks.
        """
        mpi = {"mpi": launcher} if self.tasks > 1 else {}
        return {
            "tasks": self.tasks,
            "cpus_per_task": self.cpus_per_task,
            "mem_mb": self.mem_mb,
            "runtime": self.runtime,
            **mpi,
        }


@dataclass(frozen=True, slots=True)
class _Size:
    """Seconds of the stages on one core or on the ranks of the case, joints at a time, memory of the model [B]."""

    seconds: Mapping[str, float]
    joints: int
    memory: float


def stage_resources(case: Case, walltime_factor: float = 1.0, cores: int = MOST_CORES) -> dict[str, Resources]:
    """Foresee what the jobs of a case need.

    Args:
        case: the case.
        walltime_factor: by which they are given more time.
        cores: of the largest machine.

    Returns:
        Stage -> resources, of those stages that are jobs.
    """
    size = _size(case)
    ranks = {"shock": case.ranks, "reflow": case.ranks_by_key.get("reflow.ranks", 1)}
    threads = {"reflow": max(1, min(size.joints, cores, MOST_CORES))} if ranks["reflow"] == 1 else {}
    found = {}
    for stage in case.pipeline.names:
        if stage in WITH_COMMAND:
            continue
        tasks, cpus = ranks.get(stage, 1), threads.get(stage, 1)
        seconds = size.seconds.get(stage, 0.0)
        if stage == "reflow":
            seconds /= min(tasks * cpus, size.joints)
        memory = MEGABYTES + MEGABYTES_OF_PROCESS * tasks * cpus + 1e-6 * size.memory
        runtime = walltime_factor * (MINUTES + MARGIN * seconds / 60.0)
        found[stage] = Resources(tasks, cpus, ceil(memory), ceil(runtime))
    return found


def _size(case: Case) -> _Size:
    if isinstance(case, PackageCase):
        return _of_package(case)
    if isinstance(case, StructureCase):
        return _of_structure(case)
    return _of_scene(case)


def _of_package(case: PackageCase) -> _Size:
    from reflowshock.fem.estimates.solver_cost import cooling_cost
    from reflowshock.workflow.board_drop.forecast import forecast

    outlook = forecast(case)
    joints = max(1, outlook.distinct)
    elements = sum(part.elements for part in outlook.parts.values())
    memory = BYTES_OF_ELEMENT * elements + BYTES_OF_PARTICLE * outlook.particles[1]
    if elements and outlook.effects.get("residual_stress", {}).get("on"):
        memory += cooling_cost(elements, 0).memory
    # The forecast is that of this machine's cores.
    reflow = outlook.seconds["reflow"] * min(available_cores(), joints)
    return _Size({**outlook.seconds, "reflow": reflow}, joints, memory)


def _of_structure(case: StructureCase) -> _Size:
    from reflowshock.workflow.structure.forecast import forecast_structure

    outlook = forecast_structure(case)
    elements = sum(layer.elements for layer in outlook.layers.values())
    implicit = outlook.solvers.implicit.memory if "implicit" in case.dynamics.solvers else 0.0
    return _Size(outlook.seconds, 1, BYTES_OF_ELEMENT * elements + outlook.solvers.explicit.memory + implicit)


def _of_scene(case: Case) -> _Size:
    from reflowshock.workflow.solder.forecast import forecast_scene

    outlook: Any = forecast_scene(case)
    return _Size(outlook.seconds, 1, BYTES_OF_PARTICLE * outlook.particles)
