"""Entry point of the ranks that reflow joints: `mpirun -n N python -m workflow.reflow FOLDER WORK`, see `ranks.py`.

Exit code 1 when a joint fails, upon which mpirun ends all.
"""

import os
import sys
from pathlib import Path

from reflowshock.fem.parallel.mpi_environment import without_mpi_job
from reflowshock.workflow.process.kernel_folder import choose_kernel_folder
from reflowshock.workflow.reflow.rank import find, main

if __name__ == "__main__":
    own = without_mpi_job(os.environ)  # PETSc's MPI is to be each rank's own: else it would wait for those without work
    os.environ.clear()
    os.environ.update(own | {"NUMBA_NUM_THREADS": "1"})
    choose_kernel_folder()
    sys.exit(main(Path(sys.argv[1]), find(sys.argv[2])))
