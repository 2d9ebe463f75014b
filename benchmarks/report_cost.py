"""Cost of a report: processor time beyond loading the program, and size of the page.

Run: PYTHONPATH=. .venv/bin/python benchmarks/report_cost.py [RUN ...]   (a minute; writes results/report_cost.json)
Without run folders it first runs the shortened case of the tests in build/report_cost.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from time import process_time

from benchmarks.support import results

ROOT = Path(__file__).resolve().parents[1]
NAME = "report_cost"
CASE, RUN = ROOT / "tests/pipeline/small.toml", ROOT / "build/report_cost"


def run_small_case() -> Path:
    """Run the shortened case, which does nothing if its results are up to date; return its run folder."""
    line = [sys.executable, "-m", "reflowshock", "run", str(CASE), "--out", str(RUN)]
    subprocess.run(line, check=True, cwd=ROOT)
    return RUN


def measure_cost(run: Path) -> dict:
    """Write the report of a run in a separate process; return its cost, as ``render_once`` measures it."""
    line = [sys.executable, __file__, "--one", str(run)]
    output = subprocess.run(line, check=True, cwd=ROOT, capture_output=True, text=True).stdout
    return json.loads(output.splitlines()[-1])


def render_once(run: Path) -> dict:
    """Write the report of a run into a temporary folder and measure its cost.

    Args:
        run: Run folder; not changed.

    Returns:
        ``run`` (name), ``processor_seconds`` beyond loading, ``loading_seconds``, and ``bytes`` of the page.
    """
    from reflowshock.workflow.pipeline.points import read_case_of_run
    from reflowshock.workflow.pipeline.report import write_report

    case, loaded = read_case_of_run(run), process_time()
    with tempfile.TemporaryDirectory() as folder:
        write_report(run, case, Path(folder))
        size = (Path(folder) / "report.html").stat().st_size
    return {"run": run.name, "processor_seconds": process_time() - loaded, "loading_seconds": loaded, "bytes": size}


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps(render_once(Path(sys.argv[2]))))
        raise SystemExit
    rows = [measure_cost(run) for run in map(Path, sys.argv[1:])] or [measure_cost(run_small_case())]
    results.write_figures(NAME, {"reports": rows})
    for row in rows:
        print("{run}: {processor_seconds:.2f} s, {bytes} B; loading the program {loading_seconds:.2f} s".format(**row))
