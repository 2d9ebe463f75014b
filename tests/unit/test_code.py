"""The rules that the code itself keeps: style, types, who may import whom, size of files."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("workflow", "meshing", "particles", "fem")
HEAVY = {"gmsh", "numba", "dolfinx", "petsc4py", "mpi4py", "pyvista", "matplotlib", "vtkmodules"}
LONGEST_FILE = 400
PICKLING = {"pickle", "_pickle", "cPickle", "cloudpickle", "dill", "joblib", "marshal", "shelve"}
UNPICKLING = {"read_pickle", "to_pickle", "allow_pickle", "eval", "exec"}
SUSPECT = re.compile("|".join(PICKLING | UNPICKLING))  # files without these words are not parsed


def run_tool(*arguments: str) -> None:
    """Run a tool of the development environment with arguments and check that it succeeds."""
    result = subprocess.run(
        [sys.executable, *arguments], cwd=ROOT, capture_output=True, text=True, timeout=300, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr


def test_ruff():
    run_tool("-m", "ruff", "check", *PACKAGES, "reflowshock", "docs", "tests", "benchmarks")


@pytest.mark.skipif(np.lib.NumpyVersion(np.__version__) >= "2.0.0", reason="types are those that NumPy 1 declares")
def test_types():
    run_tool("-m", "mypy")


def test_import_rules():
    run_tool("-c", "from importlinter.cli import lint_imports_command as main; main()")


@pytest.mark.parametrize("package", PACKAGES)
def test_no_file_that_is_read_can_run_code(package):
    """Pickles and their like are code; `np.load` takes none unless `allow_pickle` is set, and nothing sets it."""
    violations = []
    texts = {path: path.read_text() for path in (ROOT / package).rglob("*.py")}
    for path in filter(lambda path: SUSPECT.search(texts[path]), texts):
        for node in ast.walk(ast.parse(texts[path])):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            odd = [name for name in names if name.partition(".")[0] in PICKLING]
            if isinstance(node, ast.keyword) and node.arg == "allow_pickle":
                odd += ["allow_pickle"] * (getattr(node.value, "value", None) is not False)
            if isinstance(node, ast.Attribute | ast.Name):
                odd += [name for name in (getattr(node, "attr", ""), getattr(node, "id", "")) if name in UNPICKLING]
            violations += [f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 0)}: {name}" for name in odd]
    assert not violations


@pytest.mark.parametrize("package", PACKAGES)
def test_files_are_short(package):
    long = {
        path.name: lines
        for path in (ROOT / package).rglob("*.py")
        if (lines := len(path.read_text().splitlines())) > LONGEST_FILE
    }
    assert not long


def test_imports_are_light():
    """One process imports them in turn, so that a failure shows the first that loads a heavy library."""
    names = ("", ".workflow.cli", ".workflow.pipeline.reader", ".workflow.stages", ".workflow.plan")
    check = f"loaded = {HEAVY} & set(sys.modules); assert not loaded, loaded"
    run_tool("-c", "\n".join(["import sys", *(f"import reflowshock{name}; {check}" for name in names)]))


def test_plans_are_light():
    """A report predicts costs and draws pictures, and VTK draws no text in a process that has loaded DOLFINx."""
    lines = [
        "import sys; from pathlib import Path; from rich.console import Console",
        "from reflowshock.workflow.pipeline.reader import read_case; from reflowshock.workflow.plan import show_plan",
        "from reflowshock.workflow.store.point import Point; from reflowshock.workflow.store.store import Store",
        "for name in ('bga_drop', 'hu_bga_drop', 'two_scale_bar', 'sessile_drop', 'oscillating_drop'):",
        f"    case = read_case(Path('{ROOT}/cases') / name / 'case.toml', [], True)",
        "    show_plan(Store(Path('nowhere'), one_run=True), Point({}, case), Console(quiet=True))",
        "    solved = {'petsc4py'} if name == 'oscillating_drop' else set()",  # its forecast loads the solver
        "    assert not {'dolfinx', 'mpi4py', 'petsc4py'} & set(sys.modules) - solved, name",
    ]
    run_tool("-c", "\n".join(lines))


@pytest.mark.parametrize("first, second", [("dolfinx", "h5py"), ("h5py", "dolfinx")])
def test_one_hdf5_in_a_process(tmp_path, first, second):
    file = str(tmp_path / "numbers.h5")
    run_tool("-c", f"import {first}, {second}, h5py; h5py.File({file!r}, 'w')['numbers'] = [1.0, 2.0]")
