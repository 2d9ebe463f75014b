"""What can be known to be wrong before any job is submitted."""

import shutil
from collections.abc import Iterator, Sequence
from importlib.util import find_spec

from reflowshock.names import nearest
from reflowshock.problem import Problem
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.jobs.profile import FILE, Profile
from reflowshock.workflow.jobs.queue import NoAnswer, Partition, partitions

PLUGIN = "snakemake_executor_plugin_slurm"


def check_slurm(profile: Profile, cases: Sequence[Case]) -> Partition:
    """Find out whether jobs can be submitted, and whether a case asks for more than there is.

    Args:
        profile: of the cluster.
        cases: that are to be run.

    Returns:
        The partition that jobs go to.

    Raises:
        CaseError: with all that is wrong.
    """
    problems = list(_missing())
    if problems:
        raise CaseError("run", problems)
    try:
        found = partitions()
    except NoAnswer as error:
        raise CaseError("run", [Problem("--executor", f"Slurm does not answer: {error}", "slurm")]) from error
    partition = _chosen(profile, found)
    problems = [problem for case in cases for problem in _too_large(case, partition)]
    if problems:
        raise CaseError("run", problems)
    return partition


def _missing() -> Iterator[Problem]:
    if shutil.which("sbatch") is None:
        where = "a machine from which Slurm takes jobs, or --executor local"
        yield Problem("--executor", "sbatch is not installed here", "slurm", where)
    if find_spec(PLUGIN) is None:
        message = "Snakemake's plugin for Slurm is not installed; pip install 'reflowshock[cluster]' brings it"
        yield Problem("--executor", message, "slurm")


def _chosen(profile: Profile, found: Sequence[Partition]) -> Partition:
    """Return the partition of the profile, else the default one; where there is none, the first."""
    if not found:
        raise CaseError("run", [Problem("--executor", "Slurm has no partition for you", "slurm")])
    if not profile.partition:
        return next((partition for partition in found if partition.is_default), found[0])
    names = [partition.name for partition in found]
    if profile.partition not in names:
        key, hint = "default-resources.slurm_partition", nearest(profile.partition, names)
        problem = Problem(key, "is not a partition here", profile.partition, ", ".join(names), hint)
        raise CaseError(str(profile.folder / FILE), [problem])
    return found[names.index(profile.partition)]


def _too_large(case: Case, partition: Partition) -> Iterator[Problem]:
    for key, ranks in case.ranks_by_key.items():
        if ranks > partition.cores:
            message = f"asks for {ranks} MPI ranks, Slurm's partition {partition.name} has {partition.cores} cores"
            yield Problem(key, message, ranks, f"<= {partition.cores} in all")
