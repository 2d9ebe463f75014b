"""Store the convergence study of a case in the folder of the case: ``accuracy.json`` and its plot.

Run: PYTHONPATH=. .venv/bin/python benchmarks/support/publish_accuracy.py sessile_drop -- --tolerance 0.03%
The site shows the stored tables, and reports of similar cases show them unless they have their own.
"""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

from reflowshock.workflow.convergence.accuracy_file import FILE
from reflowshock.workflow.convergence.page import PICTURE

ROOT = Path(__file__).resolve().parents[2]


def main() -> None:
    """Run the command ``accuracy`` and copy its result into the folder of the case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", help="folder of cases/")
    parser.add_argument("options", nargs="*", help="options of the command accuracy, after --")
    arguments = parser.parse_args()
    folder, case = Path("runs") / f"{arguments.case}-accuracy", Path("cases") / arguments.case
    command = [sys.executable, "-m", "reflowshock", "accuracy", str(case / "case.toml"), "--out", str(folder)]
    subprocess.run([*command, *arguments.options], cwd=ROOT, check=True)
    for name in (FILE, PICTURE):
        shutil.copy(ROOT / folder / name, ROOT / case / name)


if __name__ == "__main__":
    main()
