"""Resources of cluster jobs per stage: ranks, cores, memory and time, from the prediction of `plan` and a margin."""

from dataclasses import dataclass
from math import ceil

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.kinds import kind_of

# Short serial stages, which run in the command instead of a job.
WITH_COMMAND = ("comparison", "errors", "report")
MOST_CORES = 16  # for a reflow with processes on one node
MEGABYTES, MEGABYTES_OF_PROCESS = 1500, 500  # interpreter, Snakemake, libraries
MINUTES, MARGIN = 10, 3.0  # wall time: constant part for start and compilation, factor on the forecast


@dataclass(frozen=True, slots=True)
class Resources:
    """Resources that a job requests.

    Attributes:
        tasks: MPI ranks.
        cpus_per_task: Cores per rank.
        mem_mb: Memory on each node [MB].
        runtime: Walltime [min].
    """

    tasks: int
    cpus_per_task: int
    mem_mb: int
    runtime: int

    def of_rule(self, launcher: str) -> dict[str, int | str]:
        """Return the resources under the names of Snakemake.

        Args:
            launcher: Command that starts MPI ranks.
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
        case: The case.
        walltime_factor: Factor on the predicted wall times, a reserve for slower machines.
        cores: Number of cores of the largest node, which bounds the cores of a job.

    Returns:
        Resources by name of the stage, for stages that are jobs.
    """
    size = kind_of(case).size(case)
    ranks = {"shock": case.ranks, "reflow": case.ranks_by_key.get("reflow.ranks", 1)}
    threads = {"reflow": max(1, min(size.joints, cores, MOST_CORES))} if ranks["reflow"] == 1 else {}
    resources = {}
    for stage in case.pipeline.names:
        if stage in WITH_COMMAND:
            continue
        tasks, cpus = ranks.get(stage, 1), threads.get(stage, 1)
        seconds = size.seconds.get(stage, 0.0)
        if stage == "reflow":
            seconds /= min(tasks * cpus, size.joints)
        memory = MEGABYTES + MEGABYTES_OF_PROCESS * tasks * cpus + 1e-6 * size.memory
        runtime = walltime_factor * (MINUTES + MARGIN * seconds / 60.0)
        resources[stage] = Resources(tasks, cpus, ceil(memory), ceil(runtime))
    return resources
