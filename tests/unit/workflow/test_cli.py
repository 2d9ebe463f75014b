"""Commands that run nothing, and exit codes."""

import json
import subprocess
import tomllib
from pathlib import Path

import jsonschema
import pytest

from reflowshock.materials.library import LIBRARY
from reflowshock.workflow import cli
from reflowshock.workflow.case.fields import display_values
from reflowshock.workflow.examples import EXAMPLES
from reflowshock.workflow.pipeline.companions import at_once
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.schema import case_schema
from reflowshock.workflow.store.folders import lock_folder
from tests.support.case_schema import validate
from tests.support.command_parser import commands, parse
from tests.support.workflow_command import command_line

CASES = Path(__file__).resolve().parents[3] / "cases"
CASE = CASES / "bga_drop" / "case.toml"
DEFAULT = CASES / "jedec_bga" / "case.toml"  # the template of a new case


@pytest.fixture
def call(monkeypatch, capsys, tmp_path):
    """Call the command line in an empty folder; return exit code, output, errors."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.argv", ["reflowshock", *arguments])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        written = capsys.readouterr()
        return int(ended.value.code or 0), written.out, written.err

    return run


def test_a_new_case_is_complete_and_equal_to_its_template(call, tmp_path):
    code, _, _ = call("new", "mine")
    assert code == 0
    path = tmp_path / "mine.toml"
    mine, template = (display_values(read_case(file)) for file in (path, DEFAULT))
    assert mine == template | {"case.name": "mine"}
    values = dict(flat(tomllib.loads(path.read_text())))
    names = {key: name for key, name in values.items() if key.startswith("materials.")}
    materials = read_case(path).materials.by_role
    assert {role: LIBRARY[names[f"materials.{role}"]] for role in materials} == materials
    others = [{key for key in keys if not key.startswith(("scales.", "materials."))} for keys in (values, mine)]
    assert others[0] == others[1]


def flat(table: dict, prefix: str = ""):
    """Yield the dotted keys of a nested table."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def test_a_plan_for_scripts(call):
    code, output, _ = call("plan", str(CASE), "--set", "scale=quick", "--json")
    plan = json.loads(output)
    assert code == 0
    assert plan["stages"]["shock"] == {
        "runs": True,
        "why": "no product yet",
        "seconds": plan["stages"]["shock"]["seconds"],
    }
    stages = sum(stage["seconds"] or 0.0 for stage in plan["stages"].values())
    companions = at_once(plan["companions"].values())
    assert len(plan["companions"]) == 2
    assert plan["seconds"] == pytest.approx(plan["compilation"] + stages + companions)
    assert plan["effects"]["gravity"]["why"]


def test_a_plan_says_how_many_ranks_a_run_would_have_now(call):
    code, output, _ = call("plan", str(CASE), "--set", "scale=quick", "--set", "shock.ranks.total=auto")
    assert code == 0
    assert "decided when it starts, now" in " ".join(output.replace("│", " ").split())


def test_a_dry_run_is_a_plan(call, tmp_path):
    output = call("run", str(CASE), "--set", "scale=quick", "--dry-run")
    assert output == call("plan", str(CASE), "--set", "scale=quick")
    assert not list(tmp_path.iterdir())


def test_a_new_case_passes_plan(call):
    call("new", "mine")
    code, output, _ = call("plan", "mine.toml")
    assert code == 0
    for words in ("no product yet", "Bond number", "hexahedra", "step ratio m", "two-scale / DNS", "25 joints"):
        assert words in output


def test_a_reader_that_has_gone_is_no_error_of_petsc(tmp_path):
    process = subprocess.Popen(command_line("plan", tmp_path), stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.readline()
    process.stdout.close()
    errors = process.stderr.read()
    assert process.wait(timeout=60) == 1
    assert b"PETSC" not in errors and b"MPI_ABORT" not in errors


def test_a_new_case_overwrites_nothing(call):
    call("new", "mine")
    code, _, errors = call("new", "mine")
    assert (code, "exists already" in errors) == (2, True)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("new", "mine", "--template", "bga_dorp"), "did you mean bga_drop?"),
        (("new", "no name"), "is not a valid name"),
        (("run", str(CASE), "--until", "shok"), "is not a stage"),
        (("run", str(CASE), "--set", "shock.duration=1"), 'such as "1 ms"'),
        (("run", "absent.toml"), "does not exist"),
        (("plan", str(CASE), "--set", "shock.ranks.total=1000"), "--oversubscribe"),
        (("fly",), "No such command"),
    ],
)
def test_bad_input_has_exit_code_2(call, arguments, words, tmp_path):
    code, output, errors = call(*arguments)
    assert code == 2
    assert words in output + errors
    assert list(tmp_path.iterdir()) == []


def test_plan_writes_nothing(call, tmp_path):
    code, output, _ = call("plan", str(CASE))
    assert code == 0
    assert any(line.startswith("all ") and "about" in line for line in output.splitlines())
    assert list(tmp_path.iterdir()) == []


def test_status_of_nothing(call):
    code, output, _ = call("status", str(CASE))
    assert code == 0
    assert output.count("missing") == 7


def test_a_report_of_nothing_fails(call, tmp_path):
    code, _, errors = call("report", str(CASE))
    assert (code, "is not a run folder" in errors) == (1, True)
    assert list(tmp_path.iterdir()) == []


def test_clean_removes_run_folders_only(call, tmp_path):
    precious = tmp_path / "precious"
    (precious / "inputs").mkdir(parents=True)
    (precious / "inputs/case.json").write_text("{}")
    assert "nothing to remove" in call("clean", str(CASE), "--out", str(precious))[1]
    assert (precious / "inputs/case.json").exists()
    with lock_folder(tmp_path / "run", "run", "bga_drop"):
        pass
    assert call("clean", str(CASE), "--out", str(tmp_path / "run"))[0] == 0
    assert not (tmp_path / "run").exists()


def test_another_case_is_not_cleaned(call, tmp_path):
    with lock_folder(tmp_path / "run", "run", "other"):
        pass
    code, _, errors = call("clean", str(CASE), "--out", str(tmp_path / "run"))
    assert (code, "contains the run of other" in errors) == (2, True)


def test_nothing_is_written_next_to_files_of_a_user(call, tmp_path):
    (tmp_path / "mine.toml").write_bytes(CASE.read_bytes())
    for command in ("run", "clean"):
        call(command, "mine.toml", "--out", ".")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]


def test_a_run_folder_in_use_is_left_alone(call, tmp_path):
    with lock_folder(tmp_path / "busy", "run", "bga_drop"):
        before = sorted(tmp_path.rglob("*"))
        code, _, errors = call("run", str(CASE), "--out", str(tmp_path / "busy"))
    assert (code, "another run is active" in errors) == (1, True)
    assert sorted(tmp_path.rglob("*")) == before


def test_the_schema_accepts_cases_and_refuses_bare_numbers(call):
    code, output, _ = call("schema")
    assert code == 0
    schema = json.loads(output)
    assert schema == case_schema()
    table = tomllib.loads(CASE.read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    validate(table)
    table["package"]["pitch"] = 1.0
    with pytest.raises(jsonschema.ValidationError):
        validate(table)


def test_the_version(call):
    code, output, _ = call("--version")
    assert (code, output.startswith("reflowshock ")) == (0, True)


@pytest.mark.parametrize("command", commands())
def test_help_ends_with_examples_that_the_command_takes(call, command):
    code, output, _ = call(command, "--help")
    assert (code, "Examples:" in output) == (0, True)
    assert 1 <= len(EXAMPLES[command]) <= 3
    for line in EXAMPLES[command]:
        parse(line)


@pytest.mark.parametrize(
    ("name", "why"), [("drop.mp4", "is not the name of a GIF"), ("a.gif", "exists and is not a GIF")]
)
def test_a_movie_is_written_over_nothing_else(call, tmp_path, name, why):
    (tmp_path / "a.gif").write_text("mine")
    code, _, errors = call("report", str(CASE), "--movie", name)
    assert (code, why in errors) == (2, True)
    assert (tmp_path / "a.gif").read_text() == "mine"
