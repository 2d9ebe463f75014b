"""Terminal output is plain text: markup in messages is not interpreted."""

import ast
import io
import re
from pathlib import Path

import pytest
from rich.table import Table
from rich.text import Text

from reflowshock.workflow.process import terminal
from reflowshock.workflow.process.terminal import Terminal, new_table, progress_bar, style_text, visible

NASTY = "a[/x] [ ] [bold]b :smile: \x1b[31m\x07\x9b2J\r\u202e"
SHOWN = r"a[/x] [ ] [bold]b :smile: \x1b[31m\x07\x9b2J\r\u202e"
MARKUP = re.compile(r"\[/\]|\[/?(bold|dim|red|green|yellow)\b")
WORKFLOW = Path(terminal.__file__).parent


@pytest.fixture
def console_output():
    """A terminal of 120 columns, and its output."""
    console = Terminal(file=io.StringIO(), width=120)

    def written() -> str:
        text = console.file.getvalue()
        assert not re.search("[\x00-\x08\x0b-\x1a\x1c-\x1f\x7f-\x9f]", text)
        return text

    return console, written


def table_of(text: str) -> Table:
    """Return a table for the terminal with a text in all its places."""
    table = new_table(text, text)
    table.add_row(text)
    table.caption = text
    return table


@pytest.mark.parametrize("what", [NASTY, style_text("{}", NASTY), table_of(NASTY)], ids=["text", "styled", "table"])
def test_text_is_shown_as_it_is(console_output, what):
    console, written = console_output
    console.print(what)
    assert written().count(SHOWN) == (4 if isinstance(what, Table) else 1)
    assert "\x1b" not in written()


def test_a_text_of_rich_obeys_nothing_either(console_output):
    console, written = console_output
    console.print(Text("\x1b[31mred"))
    assert written() == "\\x1b[31mred\n"


def test_lines_and_tabs_stay():
    assert visible("a\n\tb ü µ 焊") == "a\n\tb ü µ 焊"


def test_surrogates_can_be_written():
    assert visible("\udce4") == r"\udce4"


def test_own_words_have_a_style_and_values_take_it():
    styled_text = style_text("[bold]{}[/] of {}", "[red]x", "{}")
    assert styled_text.plain == "[red]x of {}"
    assert [(span.start, span.end, str(span.style)) for span in styled_text.spans] == [(0, 6, "bold")]


def test_a_value_for_each_place():
    with pytest.raises(ValueError):
        style_text("{} {}", 1)


def test_descriptions_of_progress_are_text(console_output, monkeypatch):
    console, written = console_output
    monkeypatch.setattr("reflowshock.workflow.process.terminal.console", console)
    with progress_bar(NASTY) as bar:
        bar(0.5, NASTY)
    assert SHOWN in written()


def test_errors_are_text(monkeypatch, capsys):
    terminal.print_error(f"{NASTY}\n{NASTY}")
    assert capsys.readouterr().err == f"error: {SHOWN}\n{SHOWN}\n"


def test_a_pipe_gets_no_sequences_even_if_colours_are_forced(monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    console = Terminal(file=io.StringIO(), force_terminal=False)
    console.print(style_text("[bold red]x"))
    assert console.file.getvalue() == "x\n"


def test_words_stay_whole_on_a_narrow_terminal():
    console = Terminal(file=io.StringIO(), force_terminal=True, color_system=None, width=60)
    words = "quasi-static, only the shape at rest matters: the process time exceeds the slowest time of all by far"
    console.print(words, soft_wrap=True)
    lines = console.file.getvalue().splitlines()
    assert max(map(len, lines)) <= 60
    assert " ".join(line.strip() for line in lines) == words


def test_nothing_of_a_table_is_lost_on_a_narrow_terminal():
    console = Terminal(file=io.StringIO(), width=40)
    table = new_table("Effects", "effect", "influence", "why")
    table.add_row("surface tension", "100 %", "quasi-static, extraordinarily")
    console.print(table)
    last = "".join(line.rpartition("│")[2].strip() for line in console.file.getvalue().splitlines())
    assert "…" not in console.file.getvalue()
    assert last.endswith("quasi-static,extraordinarily")


def test_markup_is_read_in_constants_alone():
    """All markup stands in constants inside of `styled(...)`; nobody formats a text into it."""
    for path in set(WORKFLOW.rglob("*.py")) - {Path(terminal.__file__)}:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and ast.unparse(node.func) == "styled"]
        styled_ones = {id(node) for call in calls for node in ast.walk(call.args[0])}
        assert not [call for call in calls if any(isinstance(node, ast.JoinedStr) for node in ast.walk(call.args[0]))]
        constants = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
        loose = [node.value for node in constants if MARKUP.search(node.value) and id(node) not in styled_ones]
        assert not loose, path
        assert "from_markup" not in path.read_text(encoding="utf-8"), path
