"""Entry point: ``mpirun -n N python -m fem INPUT.json``. One line of JSON per progress tick on standard output.

Exit code 0 when the results are written; 1, with a message on standard error, when any rank fails.
"""

import os
import sys
import traceback

if __name__ == "__main__":
    # Waiting ranks of Open MPI spin; on a machine that does other work too, they should let it have the core. Read at
    # MPI_Init, that is when mpi4py is imported.
    os.environ.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")
    from mpi4py import MPI

    try:
        from reflowshock.fem.run.program import main

        code = main(MPI.COMM_WORLD, sys.argv[1:])
    except BaseException as error:  # an interrupt, or a library that cannot be loaded: the other ranks would wait
        why = "interrupted" if isinstance(error, KeyboardInterrupt) else f"\n{traceback.format_exc().rstrip()}"
        print(f"error: rank {MPI.COMM_WORLD.rank}: {why}", file=sys.stderr, flush=True)
        MPI.COMM_WORLD.Abort(1)
    sys.exit(code)
