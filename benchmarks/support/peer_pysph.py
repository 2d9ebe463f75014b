"""PySPH process of ``droplet_peers.py``: the dam break of the PySPH examples in its own environment.

Arguments: particle spacing [m], duration [s] and a folder. It prints one line of JSON.
"""

import json
import sys
from pathlib import Path

import pysph
from pysph.examples.dam_break_2d import DamBreak2D
from pysph.solver.utils import get_files, iter_output

spacing, until, folder = sys.argv[1:]
settings = ["--no-openmp", "--quiet", "--dx", spacing, "--tf", until, "--pfreq", "40", "-d", folder]
app = DamBreak2D()
app.run(settings)
rows = [
    (state["t"], state["count"], fluid.x.max(), len(fluid.x))
    for state, fluid in iter_output(get_files(folder), "fluid")
]
figures = {
    "version": pysph.__version__,
    "particles": int(rows[-1][3]),
    "steps": int(rows[-1][1]),
    "seconds": json.loads(next(Path(folder).glob("*.info")).read_text())["cpu_time"],
    "time": [float(row[0]) for row in rows],
    "front": [float(row[2]) for row in rows],
}
print("@" + json.dumps(figures))
