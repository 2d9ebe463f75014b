"""Reading and planning any case ends in success or in one line per problem, for cases and the files that they name."""

import io
import os
import random
import re
import time
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.template import templates
from reflowshock.workflow.plan import show_plan
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import Store
from reflowshock.workflow.study.study_file import read_study
from tests.support.workflow_command import SMALL_CASE

SEED = 20261122
MUTANTS = 80
MOST_SECONDS = 10.0
FILES = [*templates().values(), SMALL_CASE, SMALL_CASE.parent / "structure.toml"]
VALUES = (
    ["nan", "inf", "-inf", "0", "-1", "1e300", "1e-300", "99999999999999999999", "true", '""', '"x"', "[]", "{}"]
    + ["[[[]]]", '"0 mm"', '"-1 mm"', '"1e300 mm"', '"1e-300 mm"', '"1 kg"', '"nan mm"', '"5 percent"', '"1e9 G"']
    + ['"1e5 s"', '"1 ns"', '"10 m"', '"1 nm"', '"../../x"', '"a\\u0000b"', "1979-05-27", '["x", "y"]', '"auto"']
    + ['"all"', '"critical"', "1000", "0.5", '"1 mm"', '"180 deg"', '"90 deg"', '"10 N/m"', '"0.1 kg/m^3"']
    + ['"10 TPa"', '"1 kPa"', '"5000 K"', '"1 K"', '"1e12 Hz"']
)
NAMES = ("../x", "a.b", "a" * 5000, "", "x_min", "\\n", "é", "kind")
FACTORS = (1e-9, 1e-3, 0.1, 0.5, 2.0, 10.0, 1e3, 1e6, 1e12, -1.0)
PULSE = "time [ms], acceleration [G]\n0, 0\n0.25, 1500\n0.5, 0\n"
BAD_TABLES = {
    "empty": ("", "at least two rows"),
    "a header alone": ("time [ms], acceleration [G]\n", "at least two rows"),
    "one row": ("time [ms], acceleration [G]\n0, 0\n", "at least two rows"),
    "one column": ("time [ms]\n0\n1\n", "line 1: the header must name a column of times and one of values"),
    "text for a number": (PULSE + "1, x\n", "line 5: two numbers are needed"),
    "not a number": (PULSE + "1, nan\n", "line 5: .* is not finite"),
    "infinite": (PULSE + "1, inf\n", "line 5: .* is not finite"),
    "backwards": (PULSE + "0.3, 1\n", "line 5: times must increase"),
    "another unit": (PULSE.replace("[ms]", "[min]"), "needs its unit in brackets"),
    "an open quote": ('"' + PULSE, "line 1: the header must name a column of times and one of values"),
    "binary": (bytes(range(256)), "UTF-8"),
    "one endless cell": (PULSE + "1" * 200_000 + ", 0\n", "comma separated"),
    "beyond all shocks": (PULSE.replace("1500", "1e300"), "not plausible"),
}


def planned(path: Path, *settings: str, force: bool = False) -> None:
    """Read a case with settings and print its plan; nothing is run."""
    case = read_case(path, settings, oversubscribe=True, force=force)
    show_plan(Store(path.parent / "none", one_run=True), Point({}, case), Console(file=io.StringIO(), width=120))


def mutant(text: str, draw: random.Random) -> bytes:
    """Return a case file with changed bytes, lines, values, numbers or names."""
    lines, kind = text.split("\n"), draw.random()
    if kind < 0.1:
        content = bytearray(text.encode())
        for _ in range(draw.choice((1, 3, 20))):
            content[draw.randrange(len(content))] = draw.randrange(256)
        return bytes(content)
    if kind < 0.2:
        del lines[draw.randrange(len(lines))]
    elif kind < 0.25:
        lines.insert(draw.randrange(len(lines)), draw.choice(lines))
    else:
        for _ in range(draw.choice((1, 1, 2, 4))):
            line_number = draw.choice([k for k, line in enumerate(lines) if re.match(r'\s*[\w."]+\s*=', line)])
            lines[line_number] = changed(*lines[line_number].split("=", 1), draw)
    return "\n".join(lines).encode()


def changed(key: str, value: str, draw: random.Random) -> str:
    """Return a line of a case file with a random change of its value or its key."""
    kind, numbers = draw.random(), list(re.finditer(r"(?<![\w.])-?\d+\.?\d*", value))
    if kind < 0.5 or not numbers:
        return f"{key}= {draw.choice(VALUES)}"
    if kind < 0.6:
        return f'"{draw.choice(NAMES)}" ={value}'
    number = draw.choice(numbers)
    return f"{key}={value[: number.start()]}{float(number.group()) * draw.choice(FACTORS):.6g}{value[number.end() :]}"


@pytest.mark.parametrize("mutants", [MUTANTS, pytest.param(3 * MUTANTS, marks=pytest.mark.long)])
def test_any_case_is_planned_or_refused(tmp_path, capsys, mutants):
    print(f"seed {SEED}")
    draw, path = random.Random(SEED), tmp_path / "case.toml"
    refused = 0
    for number in range(mutants):
        source = draw.choice(FILES)
        path.write_bytes(mutant(source.read_text(), draw))
        start = time.monotonic()
        try:
            planned(path, force=bool(number % 2))
        except CaseError as error:
            refused += 1
            assert all("\n" not in line and str(path) in line for line in error.lines())
        except Exception as error:
            raise AssertionError(f"mutant {number} of {source}, seed {SEED}:\n{path.read_bytes()!r}") from error
        assert time.monotonic() - start < MOST_SECONDS, f"mutant {number} of {source}, seed {SEED}"
    assert 0 < refused < mutants


@pytest.fixture
def tabulated(tmp_path) -> Path:
    """Return a case whose pulse is the table pulse.csv in its folder."""
    text = re.sub(r"(?m)^(peak_acceleration|pulse_duration) .*\n", "", SMALL_CASE.read_text())
    (tmp_path / "case.toml").write_text(text.replace("[shock]\n", '[shock]\ntable = "pulse.csv"\n'))
    return tmp_path / "case.toml"


@pytest.mark.parametrize(("content", "message"), BAD_TABLES.values(), ids=BAD_TABLES.keys())
def test_a_bad_table_is_refused_in_one_line(tabulated, content, message):
    (tabulated.parent / "pulse.csv").write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(CaseError, match=rf"case\.toml:\d+:1: shock\.table.*{message}") as caught:
        planned(tabulated)
    assert len(caught.value.lines()) == 1


@pytest.mark.parametrize("kind", ["missing", "folder", "fifo", "device", "loop"])
def test_a_table_that_is_no_file_is_refused(tabulated, kind):
    path = tabulated.parent / "pulse.csv"
    if kind == "folder":
        path.mkdir()
    elif kind == "fifo":
        os.mkfifo(path)
    elif kind != "missing":
        path.symlink_to("/dev/zero" if kind == "device" else path)
    with pytest.raises(CaseError, match=r"shock\.table"):
        planned(tabulated)


@pytest.mark.parametrize("marked", ["", "\ufeff"])
def test_a_good_table_is_planned(tabulated, marked):
    (tabulated.parent / "pulse.csv").write_text(marked + PULSE)
    planned(tabulated)


def test_a_million_rows_are_read_in_seconds(tabulated):
    times = np.linspace(0.0, 0.5, 1_000_000)
    rows = np.column_stack([times, 1500.0 * np.sin(np.pi * times / 0.5)])
    with (tabulated.parent / "pulse.csv").open("w") as file:
        file.write("time [ms], acceleration [G]\n")
        np.savetxt(file, rows, "%.9g", delimiter=",")
    start = time.monotonic()
    planned(tabulated)
    assert time.monotonic() - start < MOST_SECONDS


NO_CASES = {
    "null character": (b'[case]\nname = "a\x00b"\n', r":2:\d+: is not TOML"),
    "not a text": (b"a = 1\n\xff\xfe", r":2:1: is not UTF-8 text"),
    "thousands of digits": (b"[case]\nname = " + b"9" * 5000, r":2:1: has a value that cannot be read"),
    "deep lists": (b"a = " + b"[" * 5000, "nested too deeply"),
    "deep tables": (b"a." * 500 + b"a = 1", "nested too deeply"),
    "too large": (b"#" * 4_100_000, "too large: 4.1 MB; allowed: up to 4 MB"),
    "a study": (b"[study]\nname = 'x'\n", "is a study, not a case; use reflowshock study"),
    "nothing": (b"", "has no table that identifies the kind of case"),
}


@pytest.mark.parametrize(("content", "message"), NO_CASES.values(), ids=NO_CASES.keys())
def test_files_that_are_no_cases(tmp_path, content, message):
    path = tmp_path / "case.toml"
    path.write_bytes(content)
    with pytest.raises(CaseError, match=message) as caught:
        read_case(path)
    assert len(caught.value.lines()) == 1


@pytest.mark.parametrize("kind", ["missing", "folder", "fifo", "device", "loop", "null", "long"])
def test_paths_that_are_no_files(tmp_path, kind):
    path = tmp_path / {"null": "a\0b", "long": "x" * 5000}.get(kind, "case.toml")
    if kind == "folder":
        path.mkdir()
    elif kind == "fifo":
        os.mkfifo(path)
    elif kind in ("device", "loop"):
        path.symlink_to("/dev/zero" if kind == "device" else path)
    for read in (read_case, read_study):
        with pytest.raises(CaseError) as caught:
            read(path)
        assert len(caught.value.lines()) == 1


def test_a_byte_order_mark_is_skipped(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text("\ufeff" + SMALL_CASE.read_text())
    assert read_case(path) == read_case(SMALL_CASE)


@pytest.mark.parametrize(
    "setting",
    ["=5", "a..b=1", "=", "package.pitch", "." * 100 + "=1", "a." * 500 + "a=1", "a=" + "[" * 5000, "a=" + "9" * 5000],
)
def test_settings_that_are_none(setting):
    with pytest.raises(CaseError) as caught:
        read_case(SMALL_CASE, [setting])
    assert all(line.startswith("--set: ") and "\n" not in line and len(line) < 1500 for line in caught.value.lines())


def test_a_study_of_a_billion_points_is_counted_not_written_out(tmp_path):
    path = tmp_path / "study.toml"
    values = list(range(1000))
    grid = "".join(f'"a.k{k}" = {values}\n' for k in range(3))
    path.write_text(f'[study]\nname = "s"\ncase = "c.toml"\nrank_by = "m"\n[grid]\n{grid}')
    with pytest.raises(CaseError, match="would have 1000000000 points; allowed: up to 10000"):
        read_study(path)
    with pytest.raises(CaseError, match="is a case, not a study"):
        read_study(SMALL_CASE)
