"""A forecast, which the report reads too, loads no MPI: its libraries and those that draw break each other."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
SCRIPT = """
import sys
from pathlib import Path
from workflow.case import read_case
from workflow.forecast import forecast
forecast(read_case(Path("tests/pipeline/small.toml"), [], oversubscribe=True))
loaded = {"mpi4py", "petsc4py", "dolfinx"} & set(sys.modules)
sys.exit(f"loaded: {loaded}" if loaded else 0)
"""


def test_a_forecast_loads_no_mpi():
    done = subprocess.run([sys.executable, "-c", SCRIPT], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
