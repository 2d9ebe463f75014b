"""Entry point of the ranks that reflow joints, see ``ranks.py``: ``mpirun -n N python -m workflow.reflow FOLDER WORK``.

The exit code is 1 if a joint fails; mpirun then ends all ranks.
"""

import os
import sys
from pathlib import Path

from reflowshock.fem.parallel.mpi_environment import without_mpi_job
from reflowshock.workflow.process.kernel_folder import choose_kernel_folder
from reflowshock.workflow.reflow.rank import function_of, main

if __name__ == "__main__":
    # Each rank initialises MPI alone, because PETSc would otherwise wait for ranks without work.
    environment = without_mpi_job(os.environ)
    os.environ.clear()
    os.environ.update(environment | {"NUMBA_NUM_THREADS": "1"})
    choose_kernel_folder()
    sys.exit(main(Path(sys.argv[1]), function_of(sys.argv[2])))
