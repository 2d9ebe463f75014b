"""The commands ``import`` and ``init``: what is on a board, a case for one of its components, or from five answers."""

from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.table import Table

from reflowshock.names import nearest
from reflowshock.problem import Problem
from reflowshock.units import UnitError, to_si
from reflowshock.workflow.case.names import is_name, wrong_name
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.ecad.array import array_of
from reflowshock.workflow.ecad.case_text import LEAST_HOLE, Wanted, case_text
from reflowshock.workflow.ecad.gerber import read_gerber
from reflowshock.workflow.ecad.ipc2581 import read_ipc2581
from reflowshock.workflow.ecad.kicad import read_kicad
from reflowshock.workflow.ecad.layout import Component, EcadError, Layout, checked_layout, in_mm
from reflowshock.workflow.ecad.questions import QUESTIONS, AnswerError, case_of
from reflowshock.workflow.ecad.table import read_table
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.template import write_schema
from reflowshock.workflow.process.terminal import print_error

READERS: dict[str, Callable[[Path], Layout]] = {
    ".kicad_pcb": read_kicad, ".xml": read_ipc2581, ".cvg": read_ipc2581, ".csv": read_table,
}  # fmt: skip
MOST_SHOWN = 40


def read_layout(path: Path) -> Layout:
    """Read a board: a file by its ending, or the Gerber and drill files in a folder; raise EcadError."""
    if path.is_dir():
        return checked_layout(read_gerber(path))
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        endings = ", ".join(READERS)
        raise EcadError(path, f"has an unknown ending; allowed: {endings}, or a folder of Gerber X2 and drill files")
    return checked_layout(reader(path))


def show_layout(layout: Layout, console: Console) -> None:
    """Show outline, holes and components, those with the most pads first."""
    sides = [high - low for low, high in zip(layout.low, layout.high, strict=True)]
    thickness = in_mm(layout.thickness, 4) if layout.thickness else "not said"
    console.print(f"outline {in_mm(sides[0], 6)} x {in_mm(sides[1], 6)}, thickness {thickness}")
    sizes = sorted({round(hole.diameter, 7) for hole in layout.holes}, reverse=True)
    counts = [f"{sum(round(hole.diameter, 7) == size for hole in layout.holes)} of {in_mm(size, 4)}" for size in sizes]
    console.print(f"holes: {', '.join(counts) or 'none'}")
    for note in layout.notes:
        console.print(f"note: {note}")
    table = Table("component", "value", "side", "pads", "array", box=None)
    by_pads = sorted(layout.components.items(), key=lambda item: -len(item[1].pads))
    for name, component in by_pads[:MOST_SHOWN]:
        table.add_row(name, component.value[:30], component.side, str(len(component.pads)), _array(component, layout))
    console.print(table)
    if len(by_pads) > MOST_SHOWN:
        console.print(f"and {len(by_pads) - MOST_SHOWN} more components with fewer pads")


def _array(component: Component, layout: Layout) -> str:
    try:
        array = array_of(component, layout.path)
    except EcadError:
        return ""
    return f"{array.rows} x {array.columns} at {in_mm(array.pitch, 4)}"


def write_case(path: Path, component: str, name: str | None, lengths: dict[str, str | None]) -> Path:
    """Write a case for a component of a board into the current folder.

    Args:
        path: file or folder of the board.
        component: its reference.
        name: of the case; none for that of the file and the component.
        lengths: ``--thickness``, ``--ball`` and ``--holes`` as the user gave them.

    Returns:
        The case file.

    Raises:
        CaseError: an option is not valid, there is no such component, or the file exists.
        EcadError: the board cannot be read, or has not what a case needs.
    """
    layout = read_layout(path)
    if component not in layout.components:
        known = list(layout.components)
        some = ", ".join(known[:8]) + (", …" if len(known) > 8 else "")
        problem = Problem("--component", "is not on the board", component, some or "none", nearest(component, known))
        raise CaseError("import", [problem])
    name = name or f"{path.stem}_{component}".replace(" ", "_")
    if not is_name(name):
        raise CaseError("import", [wrong_name("--name", name)])
    found = {option: _length(option, text) for option, text in lengths.items() if text is not None}
    least_hole = found.get("--holes", LEAST_HOLE)
    wanted = Wanted(name, component, found.get("--thickness"), found.get("--ball"), least_hole)
    return _written(name, case_text(layout, wanted), "import")


def _written(name: str, text: str, command: str) -> Path:
    """Write a case file that is not there yet, and read it again."""
    case = Path(f"{name}.toml")
    try:
        with case.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise CaseError(command, [Problem("name", "there is such a case file already", name, "another name")]) from None
    write_schema(case.parent)
    read_case(case)
    return case


def ask_for_case(given: dict[str, str | None], ask: Callable[[str, str], str]) -> Path:
    """Ask for what a case needs, and write it into the current folder.

    Args:
        given: answers to ``QUESTIONS`` that a user gave as options, by key.
        ask: asks a question, with the usual answer; it is asked again while the answer is not understood.

    Raises:
        CaseError: a given answer cannot be, or the file exists.
        EcadError: the board has no room for package and screws.
    """
    answers: dict[str, object] = {}
    for question in QUESTIONS:
        text = given.get(question.key)
        while question.key not in answers:
            answer = text if text is not None else ask(question.words, question.usual)
            try:
                answers[question.key] = question.read(answer)
            except AnswerError as error:
                if text is not None:
                    raise CaseError("init", [Problem(f"--{question.key}", str(error), text, question.usual)]) from error
                print_error(f"{answer!r}: {error}")
    return _written(str(answers["name"]), case_of(answers), "init")


def _length(option: str, text: str) -> float:
    try:
        value = to_si(text, "mm")
    except UnitError as error:
        raise CaseError("import", [Problem(option, str(error), text, "a length, e.g. 1.6 mm")]) from error
    if not 0.0 < value < 1.0:
        raise CaseError("import", [Problem(option, "is no such length", text, "> 0 mm and < 1 m")])
    return value
