"""Reading and validation of case files: each message names file, key, value and allowed values."""

import os
import re
from pathlib import Path

import pytest

from reflowshock.materials.library import SAC305
from reflowshock.workflow.case.fields import display_values
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.process import environment
from reflowshock.workflow.process.environment import available_cores
from tests.support.workflow_command import SMALL_CASE

BAD_VALUES = {
    "unknown key": (
        "package.pich=1 mm",
        ["package.pich", '"1 mm"', "unknown key", "did you mean package.pitch?"],
    ),
    "key of another table": ("pitch='1 mm'", ["pitch", "unknown key", "did you mean package.pitch?"]),
    "unknown table": ("pakage.rows=3", ["pakage", "unknown key", "did you mean package?"]),
    "unit missing": ("package.pitch=1.0", ["package.pitch = 1.0", 'such as "1 mm"', "allowed: > 0 mm"]),
    "unit missing in text": ('package.pitch="1.0"', ['package.pitch = "1.0"', "needs a unit"]),
    "wrong dimension": ("board.thickness=1 kg", ['board.thickness = "1 kg"', "is a mass; expected a length"]),
    "unknown unit": ("board.thickness=1 mmm", ["board.thickness", '"mmm" is not a known unit']),
    "negative length": ("package.standoff=-0.3 mm", ['package.standoff = "-0.3 mm"', "out of range", "> 0 mm"]),
    "too large": ("package.rows=101", ["package.rows = 101", "allowed: >= 1 and <= 100"]),
    "no integer": ("package.rows=2.5", ["package.rows = 2.5", "valid integer"]),
    "text for a number": ('package.rows="10"', ['package.rows = "10"', "valid integer"]),
    "unknown name": (
        "package.board_pad.definition=SDM",
        ["package.board_pad.definition", "one of SMD, NSMD", "did you mean SMD?"],
    ),
    "unknown name in a list": ('shock.numerics.modes=["tow_scale"]', ["shock.numerics.modes", "two_scale?"]),
    "unknown kind of material": (
        "materials.solder.kind=isotopic",
        ["materials.solder.kind", "one of isotropic, orthotropic", "did you mean isotropic?"],
    ),
    "value for a table": ("materials.solder=1 GPa", ["materials.solder", "must be a table"]),
    "unknown material": (
        "materials.solder=SAC306",
        ["materials.solder", "one of FR4, FR4_board,", "did you mean SAC305?"],
    ),
    "unbalanced orthotropic constants": (
        "materials.board.poisson_ratio_out_of_plane=1.2",
        [
            "materials.board.poisson_ratio_out_of_plane = 1.2",
            "energy would not be positive",
            "> -1.00906 and < 1.00906",
        ],
    ),
    "no density": ('materials.copper.density="0 kg/m^3"', ["materials.copper.density", "allowed: > 0 kg/m^3"]),
    "negative density": ("materials.die.density=-1 g/cm^3", ['"-1 g/cm^3"', "out of range", "> 0 kg/m^3"]),
    "solder too hot to be solid": (
        'materials.solder={ plasticity = { A = "38 MPa" }, temperature = "220 degC" }',
        ['materials.solder.temperature = "220 degC"', "allowed: < 217 degC, the melting_temperature"],
    ),
    "plasticity without a yield stress": (
        'materials.solder.plasticity.B="1 MPa"',
        ["materials.solder.plasticity.A", "is missing", "> 0 MPa"],
    ),
    "plastic work of elastic solder": (
        'shock.failure.layer_plastic_work={ limit = "2 MJ/m^3", source = "a test" }',
        ['shock.failure.layer_plastic_work.limit = "2000 kJ/m^3"', "does not yield", '"SAC405"'],
    ),
    "life by plastic work of elastic solder": (
        'shock.failure.life={ measure = "layer_plastic_work", constant = 1, exponent = 1, scatter = 2, source = "us" }',
        ['shock.failure.life.measure = "layer_plastic_work"', "counts drops by plastic work", "does not yield"],
    ),
    "limit without a source": (
        "shock.failure.peel_stress.limit=80 MPa",
        ["shock.failure.peel_stress.source", "is missing"],
    ),
    "limit with a blank source": (
        'shock.failure.peel_stress={ limit = "80 MPa", source = "  " }',
        ["shock.failure.peel_stress.source", "at least 1 character"],
    ),
    "negative limit": (
        'shock.failure.layer_von_mises={ limit = "-80 MPa", source = "a test" }',
        ["shock.failure.layer_von_mises.limit", "out of range", "> 0 MPa"],
    ),
    "limit that is not a table": (
        "shock.failure.peel_stress=80 MPa",
        ["shock.failure.peel_stress", "must be a table"],
    ),
    "scatter below one": (
        'shock.failure.life={ measure = "peel_stress", constant = 1, exponent = 1, scatter = 0.5, source = "us" }',
        ["shock.failure.life.scatter", "out of range", ">= 1"],
    ),
    "linear steps of solder that yields": (
        "shock.numerics.plasticity=on\nshock.numerics.dns_solver=implicit",
        ['shock.numerics.dns_solver = "implicit"', "solder yields", "allowed: explicit"],
    ),
    "linear steps of a board that turns": (
        "shock.numerics.kinematics=auto\nshock.pulse_duration=0.5 ms\nshock.duration=0.9 ms"
        "\nshock.numerics.dns_solver=implicit",
        ['shock.numerics.kinematics = "auto, here corotational"', "linear", "allowed: small, or dns_solver"],
    ),
    "unknown constant of plasticity": ("materials.solder.plasticity.D=1", ["unknown key", "one of A, B, n, C"]),
    "table below a value": ("package.rows.all=1", ["package.rows.all", "cannot be set: the key above it has a value"]),
    "no setting": ("package.rows", ["package.rows", "is not a setting", "dotted.key=value"]),
    "more ranks than cores": (
        "shock.ranks.total=4096",
        ["shock.ranks.total = 4096", "4096 MPI ranks", "--oversubscribe"],
    ),
    "pads overlapping": (
        "package.pitch=0.5 mm",
        ["package.board_pad.mask_opening", '"0.58 mm"', "0.5 mm, the pitch"],
    ),
    "volume that cannot fit its gap": (
        "solder.volume=5 mm^3",
        ["solder.volume", '"5 mm^3"', "does not fit", "< 0.31"],
    ),
    "package larger than the board": (
        "package.substrate.length=250 mm",
        ["package.substrate.length", '"250 mm"', "40 mm, the board"],
    ),
}


def problems_of(*settings: str, path: Path = SMALL_CASE) -> list[str]:
    """Return the error messages of a case with settings, which must be rejected."""
    with pytest.raises(CaseError) as caught:
        read_case(path, settings)
    return caught.value.lines()


def line_of(path: Path, start: str) -> int:
    """Return the number of the first line of a file that begins with a text."""
    return 1 + next(k for k, line in enumerate(path.read_text().splitlines()) if line.startswith(start))


@pytest.mark.parametrize(("setting", "words"), BAD_VALUES.values(), ids=BAD_VALUES.keys())
def test_bad_values_are_named(setting, words):
    text = "\n".join(problems_of(*setting.split("\n")))
    assert [word for word in words if word not in text] == []


def test_all_problems_are_reported_at_once():
    lines = problems_of("package.pich=1 mm", "board.thickness=1 kg", "package.standoff=-1 mm")
    assert len(lines) == 3
    assert all(line.startswith("--set: ") for line in lines)


def test_problems_of_the_file_name_the_file(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(SMALL_CASE.read_text().replace('standoff = "0.31 mm"', "standoff = 0.31"))
    line = line_of(path, "standoff")
    assert problems_of(path=path) == [
        f'{path}:{line}:1: package.standoff = 0.31: needs a unit, as a string such as "0.31 mm"; allowed: > 0 mm'
    ]


def test_missing_values_are_named(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(SMALL_CASE.read_text().replace('pitch = "1 mm"', ""))
    assert problems_of(path=path) == [
        f"{path}:{line_of(path, '[package]')}:2: package.pitch: is missing; allowed: > 0 mm"
    ]


TWICE, FULL = "is not TOML: this table is declared twice", "is not TOML: this key already has a value"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("package = [", ":1: is not TOML"),
        ("a = 1\na = 2", f":2: a: {FULL}"),
        ("[drop]\na = 1\n[drop]\n", f":3: drop: {TWICE}"),
        ("[a.b]\n['a'.\"b's\"]\n['a'.\"b's\"]\n", f":3: a.b's: {TWICE}"),
        ("a = { b = 1 }\na.c = 2\n", f":2: a: {FULL}"),
        ("a = 1\n[a.b]\n", f":2: a: {FULL}"),
        ("a = { b = 1, b = 2 }\n", f":1: b: {FULL}"),
        ('[a]\nx = 1\nx = """\ny"""\n', f":4: {FULL}"),
    ],
)
def test_broken_files(tmp_path, text, words):
    path = tmp_path / "case.toml"
    path.write_text(text)
    assert words in re.sub(r":(\d+):\d+: ", r":\1: ", problems_of(path=path)[0])


def test_absent_file(tmp_path):
    assert "does not exist" in problems_of(path=tmp_path / "absent.toml")[0]


def test_overrides_are_toml_or_bare_text():
    case = read_case(SMALL_CASE, ["shock.peak_acceleration=1000 G", 'shock.pulse_duration="0.4 ms"', "package.rows=2"])
    assert case.shock.peak_acceleration == pytest.approx(9806.65)
    assert case.shock.pulse_duration == pytest.approx(4e-4)
    assert case.package.rows == 2


def test_one_property_of_a_default_material_can_change():
    case = read_case(SMALL_CASE, ["materials.solder.young_modulus=40 GPa"])
    assert case.materials.solder.young_modulus == pytest.approx(40e9)
    assert case.materials.solder.density == 7440.0


def test_a_material_is_a_name_of_the_library_or_a_table():
    materials = read_case(SMALL_CASE, ["materials.solder=SAC305", "materials.die=mould_compound"]).materials
    assert materials.solder == SAC305
    assert materials.die.density == 1950.0
    settings = ['materials.solder.plasticity.A="30 MPa"', "materials.solder.temperature=100 degC"]
    solder = read_case(SMALL_CASE, settings).materials.solder
    assert (solder.plasticity.A, solder.temperature) == pytest.approx((30e6, 373.15))
    assert display_values(read_case(SMALL_CASE, settings))["materials.solder.temperature"] == "100 degC"


def test_another_kind_of_material_needs_all_its_properties():
    lines = problems_of("materials.board.kind=isotropic")
    assert [line.split(": ")[1] for line in lines] == [
        "materials.board.density", "materials.board.young_modulus", "materials.board.poisson_ratio",
    ]  # fmt: skip


def test_more_ranks_are_welcome_with_oversubscribe():
    ranks = available_cores() + 1
    assert read_case(SMALL_CASE, [f"shock.ranks.total={ranks}"], oversubscribe=True).shock.ranks.total == ranks


def test_values_are_shown_in_the_units_of_users():
    values = display_values(read_case(SMALL_CASE))
    assert values["package.pitch"] == "1 mm"
    assert values["shock.peak_acceleration"] == "1500 G"
    assert values["solder.mask_contact_angle"] == "148 deg"
    assert values["shock.numerics.modes"] == "[two_scale, dns]"


def test_cores_are_those_of_this_process(monkeypatch):
    monkeypatch.setattr(environment, "group_cores", lambda: 1e9)
    assert available_cores() == len(os.sched_getaffinity(0))
    monkeypatch.setattr(environment, "group_cores", lambda: 0.5)
    assert available_cores() == 1


def test_of_many_problems_the_first_are_shown(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text("".join(f"wrong{number} = 1\n" for number in range(1000)) + SMALL_CASE.read_text())
    with pytest.raises(CaseError) as caught:
        read_case(case)
    lines = str(caught.value).splitlines()
    assert len(lines) == 31
    assert "wrong0" in lines[0] and lines[-1].endswith(": 970 more problems")
