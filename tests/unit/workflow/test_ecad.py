"""One board in every format gives the same layout and case; damaged, hostile and unsuitable files are rejected."""

import math
from pathlib import Path

import numpy as np
import pytest

from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.ecad.array import component_view, detect_array
from reflowshock.workflow.ecad.case_text import standoff
from reflowshock.workflow.ecad.command import ask_for_case, read_layout, write_case
from reflowshock.workflow.ecad.layout import Component, EcadError, EcadPad, Layout, round_diameter
from reflowshock.workflow.pipeline.reader import read_case
from tests.support import ecad_files
from tests.support.ecad_files import CENTRE, HOLE, HOLES, MISSING, OPENING, PAD, PITCH, pads

MM = 1e-3
EXACT = 1e-6 * MM
WRITERS = {
    "kicad_pcb": ecad_files.kicad,
    "gerbers": ecad_files.gerber,
    "xml": ecad_files.ipc2581,
    "csv": ecad_files.table,
}
TURNED = [("kicad_pcb", 1), ("kicad_pcb", 3), ("xml", 2)]
NO_OPTIONS = dict.fromkeys(("--thickness", "--ball", "--holes"))


@pytest.fixture(params=WRITERS)
def board(request, tmp_path) -> Path:
    """Return the path of the board in one ECAD format."""
    pytest.importorskip("gerbonara") if request.param == "gerbers" else None
    return WRITERS[request.param](tmp_path / f"board.{request.param}")


@pytest.fixture
def in_tmp(tmp_path, monkeypatch) -> Path:
    """Return a temporary folder, which is the present one during the test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_format_gives_the_same_layout(board):
    layout = read_layout(board)
    assert (*layout.low, *layout.high) == pytest.approx((0.0, 0.0, 0.08, 0.06), abs=EXACT)
    assert layout.thickness == (None if board.suffix == ".csv" else pytest.approx(1.55e-3))
    assert np.array(sorted(hole.at for hole in layout.holes)) == pytest.approx(MM * np.array(sorted(HOLES)))
    assert [hole.diameter for hole in layout.holes] == pytest.approx([HOLE * MM] * 4)
    assert set(layout.components) >= {"U8", "L1"} and not layout.notes
    by_name = {pad.name: pad for pad in layout.components["U8"].pads}
    assert by_name.keys() == pads().keys()
    for name, (x, y) in pads().items():
        assert by_name[name].at == pytest.approx((x * MM, y * MM), abs=EXACT)
        assert by_name[name].diameter == pytest.approx(PAD * MM, abs=EXACT)
        assert by_name[name].mask_opening == pytest.approx(OPENING * MM, abs=EXACT)


def test_every_format_gives_the_same_case(board, in_tmp):
    thickness = {"--thickness": "1.55 mm"} if board.suffix == ".csv" else {}
    case = read_case(write_case(board, "U8", "mine", NO_OPTIONS | thickness))
    assert (case.package.rows, case.package.columns) == (10, 10)
    assert case.package.pitch == pytest.approx(PITCH * MM, abs=EXACT)
    assert set(case.package.depopulated) == set(MISSING)
    assert case.package.board_pad.definition == "NSMD"
    assert case.package.board_pad.mask_opening == pytest.approx(OPENING * MM, abs=EXACT)
    assert (case.board.length, case.board.width, case.board.thickness) == pytest.approx((0.08, 0.06, 1.55e-3))
    assert case.board.centre == pytest.approx(((40 - CENTRE[0]) * MM, (30 - CENTRE[1]) * MM), abs=EXACT)
    hole_centres = MM * (np.array(sorted(HOLES)) - CENTRE)
    assert np.array(sorted(case.board.holes.at)) == pytest.approx(hole_centres)
    ((_, coil),) = case.masses.items()
    assert coil.at == pytest.approx((-25 * MM, -3 * MM, 0.0), abs=EXACT)


@pytest.mark.parametrize("kind, turns", TURNED)
def test_the_board_turns_with_a_rotated_component(kind, turns, tmp_path):
    layout = read_layout(WRITERS[kind](tmp_path / f"board.{kind}", turns))
    array = detect_array(layout.components["U8"], layout.path)
    assert array.is_named and array.turns == -turns % 4
    board = component_view(layout, layout.components["U8"], array.turns)
    for pad in board.components["U8"].pads:
        row, column = ecad_files.NAMES[pad.name]
        assert pad.at == pytest.approx(((column - 4.5) * PITCH * MM, (4.5 - row) * PITCH * MM), abs=EXACT)
    sides = [high - low for low, high in zip(board.low, board.high, strict=True)]
    assert sides == pytest.approx([0.06, 0.08] if turns % 2 else [0.08, 0.06])


def test_a_component_on_the_bottom_side_mirrors_the_board():
    grid = [
        EcadPad(f"{'AB'[row]}{column + 1}", (-1e-3 * column, -1e-3 * row), 4e-4)
        for row in (0, 1)
        for column in (0, 1, 2)
    ]
    below = Component("U1", "", "bottom", tuple(grid))
    layout = board_with(below)
    seen = component_view(layout, below)
    assert detect_array(seen.components["U1"], layout.path).turns == 0
    assert seen.components["U1"].side == "top"


def board_with(component):
    """Return a layout with one component."""
    return Layout(Path("a"), (-1e-2, -1e-2), (1e-2, 1e-2), 1e-3, (), {component.reference: component})


def test_pins_with_other_names_leave_the_orientation_open():
    grid = [EcadPad(str(k), (1e-3 * (k % 3), 1e-3 * (k // 3)), 4e-4) for k in range(6)]
    array = detect_array(Component("U1", "", "top", tuple(grid)), Path("a"))
    assert (array.rows, array.columns, array.is_named, array.turns) == (2, 3, False, 0)


@pytest.mark.parametrize(
    "pads_of, words",
    [
        ([(0, 0, 4e-4)] * 3, "an array of solder balls has at least 4"),
        ([(0, 0, 4e-4), (1e-3, 0, 4e-4), (0, 1e-3, 4e-4), (1e-3, 1e-3, 5e-4)], "0.4 mm to 0.5 mm"),
        ([(0, 0, 4e-4), (1e-3, 0, 4e-4), (0, 1e-3, 4e-4), (1.4e-3, 1e-3, 4e-4)], "off a square grid"),
        ([(1e-3 * k, 0, 4e-4) for k in range(5)], "is not an array: 1 x 5"),
    ],
)
def test_pads_that_form_no_array_are_rejected(pads_of, words):
    component = Component("U1", "", "top", tuple(EcadPad(str(k), (x, y), d) for k, (x, y, d) in enumerate(pads_of)))
    with pytest.raises(EcadError, match=words):
        detect_array(component, Path("board"))


def test_an_outline_with_an_arc_is_noted_and_boxed(tmp_path):
    arc = '(gr_arc (start 80 0) (mid 90 -30) (end 80 -60) (layer "Edge.Cuts"))'
    layout = read_layout(ecad_files.kicad(tmp_path / "a.kicad_pcb", extra=arc))
    assert layout.high[0] == pytest.approx(0.09, abs=1e-5)
    assert "not a rectangle" in layout.notes[0]


def test_text_of_a_board_cannot_inject_toml_into_a_case(in_tmp):
    board = ecad_files.kicad(in_tmp / 'a".kicad_pcb')
    board.write_text(board.read_text().replace('"10 uH"', '"x\n[shock.failure]\npeel_stress = 1"'))
    text = write_case(board, "U8", "mine", NO_OPTIONS).read_text()
    assert "[shock.failure]\n" not in text
    assert not read_case(in_tmp / "mine.toml").shock.failure.model_fields_set


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda text: text[: len(text) // 2], "truncated"),
        (lambda text: text + ")", "brackets do not match"),
        (lambda text: "(" * 5000 + text, "brackets do not match"),
        (lambda text: "", "does not begin with"),
        (lambda text: text.replace("Edge.Cuts", "F.Fab"), "outline is missing"),
        (lambda text: text.replace("(size 0.36 0.36)", "(size nan 0.36)"), "size = nan"),
        (lambda text: text.replace("(size 0.36 0.36)", "(size big 0.36)"), "is not a number"),
        (lambda text: text.replace("(size 0.36 0.36)", "(size 0.36)"), "has 1 numbers; required: 2"),
        (lambda text: text.replace("(thickness 1.55)", "(thickness 1e300)"), "out of range; allowed: up to"),
        (lambda text: text.replace("(thickness 1.55)", "(thickness -1)"), "thickness of -1 mm"),
        (lambda text: text.replace("(end 80.0 -60.0)", "(end 80.0 0)"), "80 mm x 0 mm is too small"),
        (lambda text: text.replace("(size 0.36 0.36)", "(size 0 0)"), "size of a pad of U8 is not positive"),
    ],
)
def test_damaged_boards_of_kicad(change, words, tmp_path):
    path = ecad_files.kicad(tmp_path / "a.kicad_pcb")
    path.write_text(change(path.read_text()))
    with pytest.raises(EcadError, match=words):
        read_layout(path)


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda text: text[: len(text) // 2], "is damaged"),
        (lambda text: text.replace("<IPC", '<!DOCTYPE a [<!ENTITY b "b">]><IPC', 1), "declares XML entities"),
        (lambda text: text.replace("IPC-2581", "svg"), "is not IPC-2581: its root element is svg"),
        (lambda text: text.replace('units="MILLIMETER"', 'units="FURLONG"'), "FURLONG.*allowed: MILLIMETER"),
        (lambda text: text.replace("<Profile>", "<Other>").replace("</Profile>", "</Other>"), "outline is missing"),
        (lambda text: text.replace('id="PAD"', 'id="OTHER"', 1), "is in no dictionary"),
        (lambda text: text.replace('diameter="3.2"', 'diameter="inf"'), "diameter of Hole = inf"),
    ],
)
def test_damaged_ipc_2581(change, words, tmp_path):
    path = ecad_files.ipc2581(tmp_path / "a.xml")
    path.write_text(change(path.read_text()))
    with pytest.raises(EcadError, match=words):
        read_layout(path)


@pytest.mark.parametrize(
    "name, change, words",
    [
        ("top.gtl", lambda text: text[: len(text) // 2], "truncated"),
        ("top.gtl", lambda text: text.replace("%TO.P,", "%TO.N,"), "no pad has a component attribute"),
        ("top.gtl", lambda text: text.replace("%MOMM*%", ""), "cannot be read"),
        ("edge.gm1", lambda text: text.replace("Profile,NP", "Other,User"), "outline is missing"),
        ("drill.drl", lambda text: text.replace("M30", ""), "truncated"),
        ("mask.gts", lambda text: text.replace("D10*\n", ""), "without an aperture"),
    ],
)
def test_damaged_gerbers(name, change, words, tmp_path):
    pytest.importorskip("gerbonara")
    folder = ecad_files.gerber(tmp_path / "gerbers")
    (folder / name).write_text(change((folder / name).read_text()))
    with pytest.raises(EcadError, match=words):
        read_layout(folder)


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda text: text.replace("x [mm]", "x"), "'x' has no unit of length"),
        (lambda text: text.replace("pin,", "ball,", 1), "column pin is missing"),
        (
            lambda text: text.replace("hole,,,4.0", "bore,,,4.0"),
            'a.csv:6:1: kind = "bore": unknown kind; allowed: outline, hole, pad',
        ),
        (lambda text: text.replace(",3200,", ",,"), "a.csv:6:1: diameter: is missing"),
        (lambda text: text.replace("outline", "hole"), "diameter: is missing"),
        (lambda text: "", "column kind is missing"),
    ],
)
def test_damaged_tables(change, words, tmp_path):
    path = ecad_files.table(tmp_path / "a.csv")
    path.write_text(change(path.read_text()))
    with pytest.raises(EcadError, match=words):
        read_layout(path)


def test_files_that_are_not_boards_are_rejected(tmp_path):
    (tmp_path / "a.zip").write_bytes(b"PK")
    (tmp_path / "b.kicad_pcb").write_bytes(b"\xff\xfe\x00")
    for name, words in (
        ("a.zip", "unknown suffix"),
        ("b.kicad_pcb", "cannot be read as text"),
        ("c.xml", "no such file"),
    ):
        with pytest.raises(EcadError, match=words):
            read_layout(tmp_path / name)


@pytest.mark.parametrize(
    "component, name, lengths, words",
    [
        ("U88", "mine", {}, "did you mean U8"),
        ("U8", "a/b", {}, "not a valid name"),
        ("U8", "mine", {"--ball": "0.5"}, "needs a unit"),
        ("U8", "mine", {"--thickness": "-1 mm"}, "not in the allowed range"),
        ("U8", "mine", {"--holes": "5 mm"}, "no hole of 5 mm"),
        ("L1", "mine", {}, "an array of solder balls has at least 4"),
    ],
)
def test_import_errors_name_the_problem(component, name, lengths, words, in_tmp):
    board = ecad_files.kicad(in_tmp / "a.kicad_pcb")
    with pytest.raises((CaseError, EcadError), match=words):
        write_case(board, component, name, NO_OPTIONS | lengths)
    assert not list(in_tmp.glob("*.toml"))


def test_a_case_is_never_overwritten(in_tmp):
    board = ecad_files.kicad(in_tmp / "a.kicad_pcb")
    write_case(board, "U8", None, NO_OPTIONS)
    with pytest.raises(CaseError, match="already"):
        write_case(board, "U8", None, NO_OPTIONS)


def test_standoff_solves_the_truncated_sphere():
    radius, height = 2e-4, 3.1e-4
    assert standoff(math.pi * height * (6 * radius**2 + height**2) / 6, radius) == pytest.approx(height)


def test_shapes_get_the_diameter_of_the_circle_of_equal_area():
    assert round_diameter("circle", 2.0, 2.0) == 2.0
    assert round_diameter("oval", 2.0, 2.0) == pytest.approx(2.0)
    assert round_diameter("rect", math.pi, 1.0) == pytest.approx(2.0)


@pytest.fixture
def prompter():
    """Return a class that answers questions in order and records them."""

    class Prompter(list):
        def __init__(self, *answers):
            super().__init__()
            self.answers = list(answers)

        def __call__(self, prompt, default):
            self.append(prompt)
            return self.answers.pop(0) if self.answers else default

    return Prompter


def test_five_questions_make_a_case(in_tmp, prompter):
    questions = prompter("mine", "6 x 6 at 0.8 mm", "0.45 mm", "60 x 50 x 1 mm", "B")
    case = read_case(ask_for_case({}, questions))
    assert len(questions) == 5
    assert (case.package.rows, case.package.columns, case.package.pitch) == (6, 6, pytest.approx(8e-4))
    assert case.solder.volume == pytest.approx(math.pi / 6 * 0.45e-3**3, rel=1e-4)
    assert (case.board.length, case.board.width, case.board.thickness) == pytest.approx((0.06, 0.05, 1e-3))
    assert (case.board.symmetry, case.shock.service_condition) == ("quarter", "B")
    assert (in_tmp / "reflowshock.schema.json").exists()


def test_default_answers_give_the_jedec_board(in_tmp, prompter):
    case = read_case(ask_for_case({}, prompter()))
    assert sorted(case.board.hole_places)[-1] == pytest.approx((52.5e-3, 35.5e-3))


def test_an_odd_array_has_a_whole_board(in_tmp, prompter):
    assert read_case(ask_for_case({"array": "5 x 7 at 0.65 mm"}, prompter())).board.symmetry == "full"


def test_a_question_is_repeated_until_its_answer_is_valid(in_tmp, prompter, capsys):
    questions = prompter(
        "mine", "6 by 6", "1 x 6 at 1 mm", "6 x 6 at 1 m", "6 x 6 at 0.5 mm", "big", "usual", "3 mm", "60x50x1mm"
    )
    case = read_case(ask_for_case({}, questions))
    assert case.package.pitch == pytest.approx(5e-4)
    errors = capsys.readouterr().err
    for words in ("is not valid", "allowed: 2 x 2 to 100 x 100", "out of range"):
        assert words in errors


@pytest.mark.parametrize(
    "key, answer, words",
    [
        ("name", "a/b", "not a valid name"),
        ("array", "6 x 6", "rows x columns at pitch"),
        ("ball", "9 mm", "allowed: 0.02 mm to 3 mm"),
        ("board", "9 m x 1 m x 1 mm", "out of range"),
        ("drop", "Z", "allowed: A, B, C"),
    ],
)
def test_an_invalid_option_is_rejected(key, answer, words, in_tmp, prompter):
    with pytest.raises(CaseError, match=words):
        ask_for_case({key: answer}, prompter())
    assert not list(in_tmp.iterdir())
