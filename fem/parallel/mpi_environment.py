"""Environment of child processes that must not belong to the parent's MPI job; does not load MPI."""

from collections.abc import Mapping

# Open MPI sets these variables in a process that initialised MPI. A child process that inherits them takes itself for a
# part of that job and fails, for example when started from a notebook that imported mpi4py.
OTHER_MPI_JOB = (
    "PMIX_NAMESPACE", "PMIX_RANK", "PMIX_ID", "PMIX_SERVER_", "PMIX_DSTORE_", "PMIX_SECURITY_MODE", "PMIX_GDS_MODULE",
    "PMIX_BFROP_BUFFER_TYPE", "PMIX_VERSION", "PMIX_HOSTNAME", "PMIX_SYSTEM_TMPDIR", "PMIX_MCA_psec", "ORTE_",
    "OMPI_COMM_WORLD_", "OMPI_APP_CTX_", "OMPI_NUM_APP_CTX", "OMPI_FIRST_RANKS", "OMPI_UNIVERSE_SIZE", "OMPI_COMMAND",
    "OMPI_ARGV", "OMPI_FILE_LOCATION", "OMPI_MCA_ess", "OMPI_MCA_orte_", "OMPI_MCA_pmix", "OMPI_MCA_initial_wdir",
    "OMPI_MCA_shmem_RUNTIME_QUERY_hint", "OMPI_MCA_mpi_oversubscribe", "PRTE_", "OMPI_MCA_prte", "PMI_",
)  # fmt: skip


def without_mpi_job(environment: Mapping[str, str]) -> dict[str, str]:
    """Return a copy of environment variables without those of an MPI job, so that a child can start its own job.

    Args:
        environment: Variable name -> value, such as ``os.environ``; unchanged.
    """
    return {name: value for name, value in environment.items() if not name.startswith(OTHER_MPI_JOB)}
