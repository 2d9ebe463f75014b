"""The program from Python: loading and planning cases; contents of wheel and source distribution."""

import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

import reflowshock

ROOT = Path(__file__).resolve().parents[2]
BGA = ROOT / "cases/bga_drop/case.toml"
HEAVY = {"dolfinx", "ufl", "numba", "gmsh", "pyvista", "pandas", "scipy", "matplotlib", "petsc4py", "mpi4py"}


def run_python(text: str, folder: Path = ROOT) -> subprocess.CompletedProcess:
    """Run the text of a Python program in a folder; return the completed process."""
    return subprocess.run([sys.executable, "-c", text], cwd=folder, capture_output=True, text=True, check=False)


def test_import_is_light():
    done = run_python(f"import sys, reflowshock; print({HEAVY} & set(sys.modules))")
    assert done.stdout.strip() == "set()", done.stderr


def test_loading_and_planning_is_light():
    light = HEAVY - {"scipy"}  # of which the forecast of a shock needs a root
    text = f"import sys, reflowshock; reflowshock.Case.load({str(BGA)!r}).plan(); print({light} & set(sys.modules))"
    done = run_python(text)
    assert done.stdout.strip() == "set()", done.stderr


def test_names_are_those_that_exist():
    assert {"Case", "Run", "CaseError"} <= set(reflowshock.__all__)
    assert all(getattr(reflowshock, name) for name in reflowshock.__all__)
    with pytest.raises(AttributeError, match="has no attribute 'Cases'"):
        reflowshock.Cases  # noqa: B018


@pytest.mark.parametrize(
    "overrides", [{"shock.peak_acceleration": "1000 G", "shock.ranks.total": 1}, ("shock.peak_acceleration=1000 G",)]
)
def test_overrides(overrides):
    case = reflowshock.Case.load(BGA, overrides)
    assert case.name == "bga_drop"
    assert case.resolved.shock.peak_acceleration == pytest.approx(9806.65)


def test_a_wrong_key_names_the_nearest():
    with pytest.raises(reflowshock.CaseError, match=r"did you mean shock\.peak_acceleration"):
        reflowshock.Case.load(BGA, {"shock.peak_aceleration": "1000 G"})


def test_plan(tmp_path):
    plan = reflowshock.Case.load(BGA).plan(tmp_path / "run")
    assert list(plan.stages) == ["geometry", "reflow", "surface", "solder_mesh", "shock", "errors", "report"]
    assert all(stage.runs and stage.why == "no product yet" for stage in plan.stages.values())
    assert plan.seconds > 1.0
    assert plan.effects["gravity"]["why"]
    assert "bga_drop" in str(plan)
    assert not (tmp_path / "run").exists()


def test_modules_of_a_users_own_are_not_imported(tmp_path):
    for name in ("workflow", "fem", "meshing", "particles", "api", "cases"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('a module of the user was imported')\n")
    done = run_python(f"import reflowshock; print(reflowshock.Case.load({str(BGA)!r}).name)", tmp_path)
    assert done.stdout.strip() == "bga_drop", done.stderr


@pytest.fixture(scope="module")
def distributions(tmp_path_factory) -> tuple[set[str], set[str]]:
    """Names of the files in a wheel and in a source distribution, made of the files that git knows."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("no checkout of git here, which knows the files of a distribution")
    source, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("dist")
    files = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout
    tracked = subprocess.run(
        ["tar", "--create", "--null", "--files-from=-"], cwd=ROOT, input=files, capture_output=True, check=True
    ).stdout
    subprocess.run(["tar", "--extract"], cwd=source, input=tracked, check=True)
    build = f"import setuptools.build_meta as build; build.build_sdist({str(out)!r}); build.build_wheel({str(out)!r})"
    subprocess.run([sys.executable, "-c", build], cwd=source, capture_output=True, check=True)
    with zipfile.ZipFile(next(out.glob("*.whl"))) as wheel, tarfile.open(next(out.glob("*.tar.gz"))) as sdist:
        below = {name.partition("/")[2] for name in sdist.getnames()}
        return set(wheel.namelist()), below


def wanted_files() -> set[str]:
    """Return the files that every installation needs, as a distribution names them."""
    names = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    rooms = tuple(f"{link.name}/" for link in (ROOT / "reflowshock").iterdir() if link.is_symlink())
    kinds = (".py", ".toml", ".html", "costs.json", "accuracy.json", "Snakefile")
    return {f"reflowshock/{name}" for name in names if name.startswith(rooms) and name.endswith(kinds)}


def test_a_wheel_and_a_source_distribution_hold_all_rooms_and_cases(distributions):
    wheel, sdist = distributions
    assert wanted_files()
    assert wanted_files() - wheel == set()
    assert wanted_files() - sdist == set()


def test_a_wheel_has_no_other_name_at_its_top(distributions):
    tops = {name.partition("/")[0] for name in distributions[0]}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"reflowshock"}


def test_a_case_and_a_plan_show_themselves_and_nothing_of_them_is_markup(tmp_path):
    case = reflowshock.Case.load(BGA, {"case.title": "<script>alert(1)</script>"})
    markup = case._repr_html_() + case.plan(tmp_path / "run")._repr_html_()
    assert "<script" not in markup and "&lt;script&gt;" in markup
    assert all(f"<td>{words}</td>" in markup for words in ("package.pitch", "1 mm", "solder_mesh", "finite rotation"))
