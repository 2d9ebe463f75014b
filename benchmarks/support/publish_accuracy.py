"""What accuracy costs, into the README of a case: its study is run; plot, table and `accuracy.json` go there.

Run: .venv/bin/python benchmarks/support/publish_accuracy.py sessile_drop -- --tolerance 0.03%   (on an idle machine)
     .venv/bin/python benchmarks/support/publish_accuracy.py sessile_drop --stored                    (measured last)
The report of any case of that kind shows the stored measurement, where it has none of its own.
"""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

from reflowshock.workflow.convergence.accuracy_file import FILE, read_accuracy
from reflowshock.workflow.convergence.page import PICTURE, markdown

ROOT = Path(__file__).resolve().parents[2]
BEGIN, END = "<!-- accuracy: written by benchmarks/support/publish_accuracy.py -->", "<!-- accuracy: end -->"


def publish(measured: Path, case: Path) -> None:
    """Copy a measurement into the folder of a case and its table into the README."""
    for name in (FILE, PICTURE):
        shutil.copy(measured / name, case / name)
    accuracy, readme = read_accuracy(case / FILE), case / "README.md"
    before, rest = readme.read_text().split(BEGIN)
    readme.write_text(f"{before}{BEGIN}\n{markdown(accuracy)}{END}{rest.split(END)[1]}")


def main() -> None:
    """Measure and publish."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", help="folder of cases/")
    parser.add_argument("--stored", action="store_true", help="measure nothing")
    parser.add_argument("options", nargs="*", help="of the command accuracy, after --")
    given = parser.parse_args()
    folder = Path("runs") / f"{given.case}-accuracy"
    if not given.stored:
        command = [
            sys.executable,
            "-m",
            "reflowshock",
            "accuracy",
            f"cases/{given.case}/case.toml",
            "--out",
            str(folder),
        ]
        subprocess.run([*command, *given.options], cwd=ROOT, check=True)
    publish(ROOT / folder, ROOT / "cases" / given.case)


if __name__ == "__main__":
    main()
