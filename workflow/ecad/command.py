"""Commands ``import`` and ``init``: list the components of a board, write a case from a board or from five answers."""

from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.table import Table

from reflowshock.names import find_nearest
from reflowshock.problem import Problem
from reflowshock.units import UnitError, to_si
from reflowshock.workflow.case.names import is_name, wrong_name
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.ecad.array import detect_array
from reflowshock.workflow.ecad.case_text import MIN_HOLE, CaseRequest, case_text
from reflowshock.workflow.ecad.gerber import read_gerber
from reflowshock.workflow.ecad.ipc2581 import read_ipc2581
from reflowshock.workflow.ecad.kicad import read_kicad
from reflowshock.workflow.ecad.layout import Component, EcadError, Layout, check_layout, in_mm
from reflowshock.workflow.ecad.questions import QUESTIONS, AnswerError, case_from_answers
from reflowshock.workflow.ecad.table import read_table
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.template import write_schema
from reflowshock.workflow.process.terminal import print_error

READERS: dict[str, Callable[[Path], Layout]] = {
    ".kicad_pcb": read_kicad, ".xml": read_ipc2581, ".cvg": read_ipc2581, ".csv": read_table,
}  # fmt: skip
MAX_ROWS = 40


def read_layout(path: Path) -> Layout:
    """Read a board from an ECAD file, by its suffix, or from a folder of Gerber and drill files.

    Args:
        path: KiCad, IPC-2581 or CSV file, or a folder.

    Returns:
        Outline, thickness (None if not in the file), holes, and components with their pads, in SI units.

    Raises:
        EcadError: The format is unknown, the file is damaged, or a dimension is not positive.
    """
    if path.is_dir():
        return check_layout(read_gerber(path))
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        suffixes = ", ".join(READERS)
        raise EcadError(path, f"unknown suffix; allowed: {suffixes}, or a folder of Gerber X2 and drill files")
    return check_layout(reader(path))


def show_layout(layout: Layout, console: Console) -> None:
    """Print a board: outline, holes and components, the components with the most pads first.

    Args:
        layout: Board as its file describes it.
        console: Console to print to.
    """
    sides = [high - low for low, high in zip(layout.low, layout.high, strict=True)]
    thickness = in_mm(layout.thickness, 4) if layout.thickness else "not given"
    console.print(f"outline {in_mm(sides[0], 6)} x {in_mm(sides[1], 6)}, thickness {thickness}")
    sizes = sorted({round(hole.diameter, 7) for hole in layout.holes}, reverse=True)
    counts = [f"{sum(round(hole.diameter, 7) == size for hole in layout.holes)} of {in_mm(size, 4)}" for size in sizes]
    console.print(f"holes: {', '.join(counts) or 'none'}")
    for note in layout.notes:
        console.print(f"note: {note}")
    table = Table("component", "value", "side", "pads", "array", box=None)
    by_pads = sorted(layout.components.items(), key=lambda item: -len(item[1].pads))
    for name, component in by_pads[:MAX_ROWS]:
        table.add_row(
            name, component.value[:30], component.side, str(len(component.pads)), _array_label(component, layout)
        )
    console.print(table)
    if len(by_pads) > MAX_ROWS:
        console.print(f"and {len(by_pads) - MAX_ROWS} more components with fewer pads")


def _array_label(component: Component, layout: Layout) -> str:
    try:
        array = detect_array(component, layout.path)
    except EcadError:
        return ""
    return f"{array.rows} x {array.columns} at {in_mm(array.pitch, 4)}"


def write_case(path: Path, component: str, name: str | None, lengths: dict[str, str | None]) -> Path:
    """Write a case for a component of a board into the current folder.

    Args:
        path: File or folder of the board.
        component: Reference of the component.
        name: Name of the case; None for one made of file and component.
        lengths: Options "--thickness", "--ball" and "--holes" -> value as the user typed it; None if not given.

    Returns:
        Path of the case file.

    Raises:
        CaseError: An option is not valid, the component does not exist, or the file exists already.
        EcadError: The board cannot be read or lacks data that a case needs.
    """
    layout = read_layout(path)
    if component not in layout.components:
        references = list(layout.components)
        allowed = ", ".join(references[:8]) + (", …" if len(references) > 8 else "")
        hint = find_nearest(component, references)
        problem = Problem("--component", "is not on the board", component, allowed or "none", hint)
        raise CaseError("import", [problem])
    name = name or f"{path.stem}_{component}".replace(" ", "_")
    if not is_name(name):
        raise CaseError("import", [wrong_name("--name", name)])
    values = {option: _length(option, text) for option, text in lengths.items() if text is not None}
    min_hole = values.get("--holes", MIN_HOLE)
    request = CaseRequest(name, component, values.get("--thickness"), values.get("--ball"), min_hole)
    return _write_new(name, case_text(layout, request), "import")


def _write_new(name: str, text: str, command: str) -> Path:
    """Write a new case file and check it by reading it."""
    case = Path(f"{name}.toml")
    try:
        with case.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise CaseError(command, [Problem("name", "the case file exists already", name, "another name")]) from None
    write_schema(case.parent)
    read_case(case)
    return case


def ask_for_case(options: dict[str, str | None], ask: Callable[[str, str], str]) -> Path:
    """Ask for the data of a case and write the case file into the current folder.

    Args:
        options: Answers to ``QUESTIONS`` given as options, by key.
        ask: Function that takes a question and its default answer and returns the answer of the user. It is called
            again until the answer is valid.

    Returns:
        Path of the case file.

    Raises:
        CaseError: An option is not valid, or the file exists already.
        EcadError: The board has no room for package and screws.
    """
    answers: dict[str, object] = {}
    for question in QUESTIONS:
        text = options.get(question.key)
        while question.key not in answers:
            answer = text if text is not None else ask(question.prompt, question.default)
            try:
                answers[question.key] = question.read(answer)
            except AnswerError as error:
                if text is not None:
                    raise CaseError(
                        "init", [Problem(f"--{question.key}", str(error), text, question.default)]
                    ) from error
                print_error(f"{answer!r}: {error}")
    return _write_new(str(answers["name"]), case_from_answers(answers), "init")


def _length(option: str, text: str) -> float:
    try:
        value = to_si(text, "mm")
    except UnitError as error:
        raise CaseError("import", [Problem(option, str(error), text, "a length, e.g. 1.6 mm")]) from error
    if not 0.0 < value < 1.0:
        raise CaseError("import", [Problem(option, "is not in the allowed range", text, "> 0 mm and < 1 m")])
    return value
