"""Who brings the joints of a case to rest."""

from reflowshock.workflow.case.run import Run
from reflowshock.workflow.package.case import PackageCase
from reflowshock.workflow.reflow.pool import JointPool
from reflowshock.workflow.reflow.processes import Processes
from reflowshock.workflow.reflow.ranks import Ranks


def open_pool(run: Run[PackageCase], joints: int) -> JointPool:
    """Return MPI ranks where the case asks for them, else processes on the cores of this machine.

    Args:
        run: case, cores, where checkpoints are.
        joints: how many there are to compute at a time.
    """
    ranks = run.case.reflow.ranks
    if ranks is None:
        return Processes(run.cores, joints)
    return Ranks(ranks, run.oversubscribe, run.checkpoints("reflow") / "ranks.jobs")
