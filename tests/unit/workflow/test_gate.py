"""The gate: names, magnitudes, memory, the question before a long run, and the place of each problem."""

import io
import resource
from pathlib import Path

import pytest
from rich.console import Console

from reflowshock.workflow.case.fields import display, leaves, quantity_of
from reflowshock.workflow.case.names import is_name
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.toml_places import Place, Places
from reflowshock.workflow.kinds import KINDS
from reflowshock.workflow.pipeline import gate
from reflowshock.workflow.pipeline.gate import Leave, ask_if_long, bytes_text, machine_memory, needed_memory, too_large
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.schema import _reachable
from reflowshock.workflow.pipeline.template import templates
from tests.support.workflow_command import SMALL_CASE

STRUCTURE = SMALL_CASE.parent / "structure.toml"
GOOD_NAMES = ("a", "bga_drop", "1", "A-1.b_2", "x" * 64)
BAD_NAMES = ("", ".", "..", "../x", "/etc", "a/b", "a b", "é", "a\n", "-a", ".a", "x" * 65, "x" * 5000, "a\0")


@pytest.mark.parametrize("name", GOOD_NAMES)
def test_names(name):
    assert is_name(name)
    assert read_case(SMALL_CASE, [f'case.name="{name}"']).case.name == name


@pytest.mark.parametrize("name", BAD_NAMES)
def test_what_is_not_a_name(name, tmp_path):
    assert not is_name(name)
    path, quoted = tmp_path / "case.toml", name.encode("unicode_escape").decode().replace("\\x", "\\u00")
    for text in (
        SMALL_CASE.read_text().replace('name = "small"', f'name = "{quoted}"'),
        f'scale = "{quoted}"\n{SMALL_CASE.read_text()}\n[scales."{quoted}"]\n"package.pitch" = "1 mm"\n',
        f'{STRUCTURE.read_text()}\n[watch."{quoted}"]\nat = ["0 mm", "0 mm", "0 mm"]\n',
        f'{STRUCTURE.read_text()}\n[supports."{quoted}"]\non = "x_min"\nhold = ["x"]\n',
    ):
        path.write_text(text)
        with pytest.raises(CaseError, match="is not a valid name; allowed: letters, digits"):
            read_case(path)


@pytest.mark.parametrize(
    "setting",
    [
        "shock.peak_acceleration=1e20 G",
        "solder.surface_tension=1e-300 N/m",
        "materials.die.density=1e-30 kg/m^3",
        "materials.solder.poisson_ratio=0.49999999",
        "package.pitch=1e-12 m",
        "solder.process_time=1e300 s",
        "solder.numerics.max_steps=100000000000",
    ],
)
def test_nonsense_is_refused_unless_forced(setting):
    with pytest.raises(CaseError, match=r"--set: .*is not plausible; allowed: .* to .*, or --force"):
        read_case(SMALL_CASE, [setting])
    try:
        read_case(SMALL_CASE, [setting], force=True)
    except CaseError as error:  # what else is wrong with it
        assert not any("plausible" in line for line in error.lines())


def test_force_lets_pass_what_can_be_computed():
    forced = read_case(SMALL_CASE, ["shock.peak_acceleration=1e8 G"], force=True)
    assert forced.shock.peak_acceleration == pytest.approx(9.80665e8)
    for wrong in ("shock.peak_acceleration=0 G", "shock.peak_acceleration=1e999 G", "package.pitch=-1 mm"):
        with pytest.raises(CaseError, match=r"is out of range|is not finite"):
            read_case(SMALL_CASE, [wrong], force=True)
    assert read_case(SMALL_CASE, ["warpage.corner=0 mm"]).warpage.corner == 0.0


def test_more_memory_than_there_is_is_refused_with_the_number(monkeypatch):
    case = read_case(SMALL_CASE)
    needed = needed_memory(case)
    assert 5e8 < needed < 2e10
    monkeypatch.setattr(gate, "machine_memory", lambda: 0.5 * needed)
    with pytest.raises(CaseError, match=r"needs about .* GB of memory, but this machine has .*B"):
        read_case(SMALL_CASE)
    assert read_case(SMALL_CASE, oversubscribe=True) == case  # for another machine
    monkeypatch.setattr(gate, "machine_memory", lambda: 2.0 * needed)
    assert read_case(SMALL_CASE) == case


def test_more_memory_than_any_machine_has_is_refused_everywhere():
    setting = "solder.numerics.spacing=2 nm"
    with pytest.raises(CaseError, match=r"needs about .* PB of memory, more than any machine has"):
        read_case(SMALL_CASE, [setting], oversubscribe=True)
    assert not list(too_large(read_case(SMALL_CASE, [setting], force=True), Leave(force=True)))


def test_a_limit_of_the_shell_counts(monkeypatch):
    monkeypatch.setattr(resource, "getrlimit", lambda _: (123_000_000, resource.RLIM_INFINITY))
    assert machine_memory() <= 123e6
    monkeypatch.setattr(gate, "_group_memory", lambda: iter([7e6]))
    assert machine_memory() == 7e6


def test_a_group_leaves_what_it_has_not_used(tmp_path):
    for name, text in (("memory.max", "1000"), ("memory.current", "600"), ("memory.stat", "inactive_file 100\n")):
        (tmp_path / name).write_text(text)
    assert list(gate._left(tmp_path)) == [500.0]
    (tmp_path / "memory.max").write_text("max")
    assert list(gate._left(tmp_path)) == []


def test_bytes_are_formatted_with_their_unit():
    assert [bytes_text(number) for number in (3.1e12, 23.4e9, 150e9, 5e5)] == ["3.1 TB", "23 GB", "150 GB", "0.5 MB"]


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("answer", "goes"), [("y\n", True), ("\n", False), ("no\n", False)])
def test_a_long_run_is_asked_for(monkeypatch, answer, goes):
    console = Console(file=io.StringIO(), force_terminal=True)
    monkeypatch.setattr("sys.stdin", Terminal(answer))
    assert ask_if_long("small", 7200.0, False, console) is goes
    assert "is predicted to take about" in console.file.getvalue()


def test_where_nobody_can_be_asked_a_long_run_needs_yes():
    console = Console(file=io.StringIO())
    with pytest.raises(CaseError, match=r"about 2\.8 h; start it with --yes") as caught:
        ask_if_long("small", 1e4, False, console)
    assert len(caught.value.lines()) == 1
    assert ask_if_long("small", 1e4, True, console)
    assert ask_if_long("small", 60.0, False, console)


TEXT = """\
# a case
title = "x"
[package]
rows = 3
pad = { diameter = "1 mm", name = "a" }
"dotted.key" = 1
text = '''
rows = 7
'''
list = [
  1,
  2,
]
[package.die]
length = 1

[[rows]]
a = 1
"""


def test_keys_are_found_in_their_lines():
    places = Places(TEXT)
    assert places("title") == Place(2, 1)
    assert places("package") == Place(3, 2)
    assert places("package.rows") == Place(4, 1)
    assert places("package.pad.diameter") == Place(5, 9)
    assert places("package.dotted.key") == Place(6, 1)
    assert places("package.list") == Place(10, 1)
    assert places("package.die.length") == Place(15, 1)
    assert places("package.die.width") == Place(14, 2)  # missing: its table
    assert places("rows.a") == Place(18, 1)
    assert places("elsewhere") is None


def test_problems_have_the_place_of_their_key(tmp_path):
    path = tmp_path / "case.toml"
    lines = SMALL_CASE.read_text().splitlines()
    number = next(k for k, line in enumerate(lines) if line.startswith("pitch"))
    lines[number] = 'pitch = "1 kg"'
    path.write_text("\n".join(lines) + '\n[scales.quick]\n"board.thickness" = "1 kg"\n')
    with pytest.raises(CaseError) as caught:
        read_case(path, ["scale=quick", "board.width=1 kg"])
    problems = {problem.key: problem for problem in caught.value.problems}
    assert (problems["package.pitch"].line, problems["package.pitch"].column) == (number + 1, 1)
    output = "\n".join(caught.value.lines())
    assert f'{path}:{number + 1}:1: package.pitch = "1 kg": is a mass; expected a length' in output
    assert f"{path}:{len(lines) + 2}:1 [scales.quick]: board.thickness" in output
    assert "--set: board.width" in output


def test_a_message_is_one_line_of_what_can_be_seen(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text('"a\\nb\\u001b[31m" = 1\n' + SMALL_CASE.read_text())
    with pytest.raises(CaseError) as caught:
        read_case(path)
    assert r"a\nb\x1b[31m" in caught.value.lines()[0]
    long = "x" * 100_000
    with pytest.raises(CaseError) as caught:
        read_case(SMALL_CASE, [f"case.name={long}"])
    assert len(caught.value.lines()[0]) < 400


@pytest.mark.parametrize("kind", [kind.case for kind in KINDS], ids=lambda kind: kind.__name__)
def test_defaults_equal_their_text(kind):
    """A line of a case file that repeats a default changes nothing."""
    for model in _reachable(kind):
        for name, field in model.model_fields.items():
            quantity, default = quantity_of(field), field.default
            for value in default if isinstance(default, tuple) else (default,):
                if quantity is not None and isinstance(value, float):
                    assert quantity.to_si(display(value, field)) == value, f"{model.__name__}.{name}"


@pytest.mark.parametrize("kind", [kind.case for kind in KINDS], ids=lambda kind: kind.__name__)
def test_units_are_annotations_of_quantities(kind):
    """Else a case could only have bare numbers."""
    for model in _reachable(kind):
        for name, field in model.model_fields.items():
            assert not any(isinstance(annotation, str) for annotation in field.metadata), f"{model.__name__}.{name}"


@pytest.mark.parametrize("path", templates().values(), ids=templates())
def test_shipped_cases_pass(path: Path, monkeypatch):
    monkeypatch.setattr(gate, "machine_memory", lambda: 16e9)
    case = read_case(path, oversubscribe=True)
    for key, value, field in leaves(case):
        quantity = quantity_of(field)
        if quantity is not None and isinstance(value, float):
            assert quantity.to_si(display(value, field)) == pytest.approx(value, rel=1e-9), key
    assert not list(too_large(case))
