"""What the job of each stage asks a cluster for: ranks, cores, memory, time; as `plan` predicts, with a margin."""

from dataclasses import dataclass
from math import ceil

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.kinds import kind_of

# Short and serial: they run beside the command, not as jobs.
WITH_COMMAND = ("comparison", "report")
MOST_CORES = 16  # of a reflow by processes, which share a machine
MEGABYTES, MEGABYTES_OF_PROCESS = 1500, 500  # interpreter, Snakemake, libraries
MINUTES, MARGIN = 10, 3.0  # of the walltime: to start and compile, over the forecast


@dataclass(frozen=True, slots=True)
class Resources:
    """Resources that a job requests.

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


def stage_resources(case: Case, walltime_factor: float = 1.0, cores: int = MOST_CORES) -> dict[str, Resources]:
    """Predict the resources of the jobs of a case.

    Args:
        case: the case.
        walltime_factor: by which they are given more time.
        cores: of the largest machine.

    Returns:
        Stage -> resources, of those stages that are jobs.
    """
    size = kind_of(case).size(case)
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
