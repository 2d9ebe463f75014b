"""Entry point: ``mpirun -n N python -m fem INPUT.json``. One line of JSON per progress tick on standard output.

Exit code 0 when the results are written; 1, with a message on standard error, when any rank fails.
"""

import os
import sys

if __name__ == "__main__":
    # Waiting ranks of Open MPI spin; on a machine that does other work too, they should let it have the core. Read at
    # MPI_Init, that is when mpi4py is imported.
    os.environ.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")
    from mpi4py import MPI

    from fem.program import main

    sys.exit(main(MPI.COMM_WORLD, sys.argv[1:]))
