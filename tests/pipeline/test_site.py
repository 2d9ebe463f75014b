"""Commands on the site are known and run: shortened here, as written in `make test-long`."""

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from reflowshock.workflow import cli
from reflowshock.workflow.board_drop.shock_effects import shock_effects
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.study.command import read_points_of
from tests.support import ecad_files
from tests.support.command_parser import parse
from tests.support.site import DOCS, OURS, ROOT, in_readmes, pages, shown

PAGES = [page for page in pages() if any(OURS.match(line) for line in shown(page))]
NAMES = [str(page.relative_to(DOCS)) for page in PAGES]
READS_A_CASE = {"run", "plan", "effects", "status", "accuracy", "report", "verify"}
WRITES_A_CASE = {"new", "init", "import"}
HOURS = 3600.0
KNOWN = (
    "mkdir ", "cp -r ", ". .venv/bin/activate", "conda activate", "pip install --no-deps --editable .", "docker run",
    "apptainer run",
)  # fmt: skip


@pytest.fixture
def scratch(tmp_path, monkeypatch) -> Path:
    """Return a reader's folder: the cases of the checkout, a board of ECAD in two formats."""
    for name in ("cases", "workflow"):
        (tmp_path / name).symlink_to(ROOT / name)
    ecad_files.kicad(tmp_path / "board.kicad_pcb")
    ecad_files.gerber(tmp_path / "gerbers")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run_here(line: str, monkeypatch) -> None:
    """Run a command of the program in this process."""
    monkeypatch.setattr("sys.argv", ["reflowshock", *shlex.split(line)[1:]])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert not ended.value.code, line


def test_the_case_of_the_readme_is_complete_and_takes_what_its_scene_calls_for(tmp_path):
    text = (ROOT / "README.md").read_text()
    lines = text[text.index("    case.name") :].split("\n\n")[0].splitlines()
    (tmp_path / "case.toml").write_text("\n".join(line.removeprefix("    ") for line in lines))
    effects = shock_effects(read_case(tmp_path / "case.toml", (), True))
    assert effects["finite_rotation"]["on"] and effects["plasticity"]["on"]


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_commands_of_a_page_run(page, scratch, monkeypatch):
    """Commands that write a case are run in order; commands that compute read their case with all settings."""
    for line in shown(page):
        if not OURS.match(line):
            assert is_known(line), line
            if line.startswith(("mkdir", "cp ")):
                subprocess.run(line, shell=True, check=True)
            continue
        if "gerbers" in line:
            pytest.importorskip("gerbonara")
        command, options = parse(line) if "--install-completion" not in line else ("", {})
        if command in WRITES_A_CASE:
            run_here(line, monkeypatch)
        elif command in READS_A_CASE and options["case"] is not None:
            read_case(Path(options["case"]), options["settings"] or [], True)
        elif command == "study":
            assert read_points_of(Path(options["study"]), True, False).possible


def is_known(line: str) -> bool:
    """Return whether the files, targets or extras of another command exist."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    if match := re.fullmatch(r"make ([a-z-]+)", line):
        return f"\n{match[1]}: " in (ROOT / "Makefile").read_text()
    if match := re.fullmatch(r"pip install 'reflowshock\[(\w+)\]'", line):
        return match[1] in extras
    if line.startswith("python -m "):
        return (ROOT / line.split()[2].replace("reflowshock.", "").replace(".", "/")).with_suffix(".py").exists()
    if match := re.search(r"docs/install/\S+", line):
        return (ROOT / match[0]).exists()
    return line.startswith(KNOWN)


def test_commands_of_readmes_are_taken():
    """Each command is parsed, and the cases that it names accept its settings."""
    lines = {line: path for path, line in in_readmes()}
    assert len(lines) > 30
    for line, path in lines.items():
        _, options = parse(line)
        case = options.get("case")
        if case is not None and str(case).startswith("cases/") and "/your/" not in line:
            try:
                read_case(ROOT / case, options.get("settings") or [], True)
            except CaseError as error:
                raise AssertionError(f"{path}: {line}") from error


@pytest.mark.long
@pytest.mark.timeout(HOURS)
@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_commands_of_a_page_run_as_written(page, scratch):
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}", "BROWSER": "true"}
    for line in shown(page):
        if OURS.match(line) or line.startswith(("mkdir", "cp ", "python ")):
            if "--install-completion" in line:
                continue  # it writes to the home folder
            done = subprocess.run(line, shell=True, env=environment, capture_output=True, text=True, check=False)
            assert done.returncode == 0, (line, done.stderr[-2000:])


@pytest.mark.long
@pytest.mark.timeout(HOURS)
def test_the_site_is_built_without_warnings(tmp_path):
    """A broken link within the site is a warning."""
    pytest.importorskip("furo", reason="the site's generator is not installed: make docs")
    options = ("--fail-on-warning", "--keep-going", "--quiet", "-c", "docs", "-d", str(tmp_path / "trees"))
    build = [sys.executable, "-m", "sphinx", *options, ".", str(tmp_path / "html")]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    assert (tmp_path / "html/docs/index.html").exists()


@pytest.mark.long
@pytest.mark.timeout(HOURS)
def test_the_notebook_runs(tmp_path):
    nbclient = pytest.importorskip("nbclient", reason="it is in the extra docs: make docs")
    pytest.importorskip("ipykernel", reason="it is in the extra docs: make docs")
    import nbformat

    (tmp_path / "docs").mkdir()
    (tmp_path / "cases").symlink_to(ROOT / "cases")
    notebook = nbformat.read(DOCS / "notebook.ipynb", as_version=4)
    nbclient.NotebookClient(notebook, timeout=HOURS, resources={"metadata": {"path": tmp_path / "docs"}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert sum("text/html" in output.get("data", {}) for output in outputs) == 5
