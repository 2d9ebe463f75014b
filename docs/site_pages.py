"""Pages of the site that are made from the checkout, and equations as MathML; Sphinx loads this as an extension.

What is made lies in `docs/generated`: the gallery, the keys of case files, the commands, the figures of validation,
the rooms of the program. Nothing here computes: every figure stands in a README or in a stored result.
"""

import ast
import json
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml

from reflowshock.workflow.effects.registry import registry
from reflowshock.workflow.examples import EXAMPLES
from reflowshock.workflow.kinds import KINDS
from reflowshock.workflow.pipeline.schema import case_schema

ROOT = Path(__file__).resolve().parent.parent
CASES = sorted(path for path in (ROOT / "cases").glob("*/README.md") if path.parent.name != "hard")
PACKAGES = ("fem", "particles", "meshing", "workflow")


def setup(app: Any) -> dict:
    """Make the pages before Sphinx reads, and register the equations."""
    write_pages(ROOT / "docs/generated")
    app.add_html_math_renderer("mathml", (_inline_equation, _leave), (_equation, _leave))
    app.connect("html-page-context", lambda *event: event[3].update(sourcename=""))
    app.connect("build-finished", _lead_to_first_page)
    return {"parallel_read_safe": True}


def write_pages(folder: Path) -> None:
    """Write every page that is made."""
    folder.mkdir(exist_ok=True)
    pages = {"gallery": gallery(), "keys": keys(), "commands": commands(), "figures": figures(), "rooms": rooms()}
    pages["effects"] = effects()
    for name, lines in pages.items():
        text = "\n".join(lines) + "\n"
        path = folder / f"{name}.md"
        if not path.exists() or path.read_text() != text:  # what is unchanged is not built again
            path.write_text(text)


def gallery() -> Iterator[str]:
    """Yield a section for each case that has pictures: what it is, and its pictures."""
    yield from ("# Gallery", "", "Pictures of the cases that ship with the program; each name leads to the case.", "")
    for path in CASES:
        pictures = re.findall(r"!\[([^\]]+)\]\(([\w.]+)\)", path.read_text())
        if not pictures:
            continue
        place = f"../../cases/{path.parent.name}"
        yield from (f"## [{_title(path)}]({place}/README.md)", "")
        for words, file in pictures:
            yield from (f"![{words}]({place}/{file})", "", f"*{words[0].upper()}{words[1:]}.*", "")


def keys() -> Iterator[str]:
    """Yield the reference of all keys: a section for each table of each kind of case."""
    schema = case_schema()
    yield from ("# Keys of case files", "")
    yield 'Made from the schema that `reflowshock schema` prints. A quantity is a string with a unit, as `"0.48 mm"`;'
    yield from ("a key without a default has to be given. NAME stands for a name that you choose.", "")
    for one, kind in zip(KINDS, schema["anyOf"], strict=True):
        yield from (f"## Cases of kind {one.case.kind}", "", _words(kind), "")
        for table, definition in _tables(kind, schema["$defs"], ""):
            if table:
                yield from (f"### {table}", "", _words(definition), "")
            yield from _rows(("key", "takes", "default"), _keys_of(definition, schema["$defs"]))


def commands() -> Iterator[str]:
    """Yield a section for each command: what it does, and examples."""
    from typer.main import get_command

    from reflowshock.workflow.cli import app

    yield from ("# Commands", "", "`reflowshock COMMAND --help` lists the options.", "")
    for name, command in get_command(app).commands.items():
        if not command.hidden:
            yield from (f"## {name}", "", _words({"description": command.help}), "")
            yield from ("```bash", *EXAMPLES[name], "```", "")


def effects() -> Iterator[str]:
    """Yield the table of all effects, which the page on theory includes."""
    found = registry().values()
    acts = ("given by the case" if one.threshold is None else f"{one.acts} {one.threshold:g}" for one in found)
    rows = (
        (one.name.replace("_", " "), one.stage, one.number, how, one.source)
        for one, how in zip(found, acts, strict=True)
    )
    yield from _rows(("effect", "stage", "number", "acts", "source"), rows)


def figures() -> Iterator[str]:
    """Yield what validation has stored: fitted orders, results of each case; tests against exact or other solutions."""
    yield from ("# Figures of validation", "", "## Orders of convergence", "")
    yield "Fitted by `reflowshock accuracy`, stored as `accuracy.json` beside the case: error(h) = C h^order."
    yield from ("", *_rows(("case", "parameter", "error", "order", "theory"), _orders()))
    yield from ("## Results of the cases", "")
    for path in CASES:
        if table := _first_table(path.read_text()):
            yield from (f"### [{_title(path)}](../../cases/{path.parent.name}/README.md)", "", *table, "")
    yield from ("## Tests against exact solutions and other programs", "")
    yield from ("`make test` runs each of these; they are in `tests/verification`.", "")
    yield from _rows(("test", "compares"), _tests())


def rooms() -> Iterator[str]:
    """Yield what each room of the program holds, from its docstring."""
    yield from ("# Rooms", "", "Folders of the program, and what each holds.", "")
    for package in PACKAGES:
        yield from (f"## [{package}](../../{package}/README.md)", "")
        paths = sorted((ROOT / package).glob("*/__init__.py"))
        yield from _rows(("room", "holds"), ((f"`{path.parent.name}`", _docstring(path)) for path in paths))


def _tables(node: dict, defs: dict, place: str) -> Iterator[tuple[str, dict]]:
    """Yield place and definition of a table and of the tables in it."""
    yield place, node
    tables = sorted(node.get("properties", {}).items(), key=lambda item: "additionalProperties" in item[1])
    for name, value in tables:  # those of the user's own names last
        inner = f"{place}.{name}".lstrip(".")
        for own, reference in _references(value):
            found = defs[reference]
            kind = found["properties"].get("kind", {}).get("const")
            yield from _tables(found, defs, inner + (".NAME" if own else "") + (f" (kind {kind})" if kind else ""))


def _references(value: dict) -> list[tuple[bool, str]]:
    """Return the definitions that a key's table may follow, and whether it holds tables of the user's names."""
    inside = value.get("additionalProperties")
    own = isinstance(inside, dict)
    choices = inside if own else value
    members = choices.get("anyOf") or choices.get("oneOf") or [choices]
    return [(own, member["$ref"].rpartition("/")[2]) for member in members if "$ref" in member]


def _keys_of(definition: dict, defs: dict) -> Iterator[tuple[str, str, str]]:
    required = definition.get("required", ())
    for name, value in definition.get("properties", {}).items():
        if name == "scales" or _references(value):
            continue
        default = "required" if name in required else _default(value)
        yield f"`{name}`", _takes(value), default


def _default(value: dict) -> str:
    found = value.get("default")
    if found is None:
        return ""
    return f"`{found if isinstance(found, str) and found else json.dumps(found)}`"


def _takes(value: dict) -> str:
    """Say what a key takes, as its schema has it."""
    if "description" in value:
        return value["description"]
    if "enum" in value or "const" in value:
        return ", ".join(f"`{name}`" for name in value.get("enum", [value.get("const")]))
    if "oneOf" in value:
        return "a table of kind " + ", ".join(f"`{name}`" for name in value["discriminator"]["mapping"])
    if "anyOf" in value:
        return " or ".join(_takes(one) for one in value["anyOf"] if one.get("type") != "null")
    words = {"boolean": "true or false", "string": "text", "array": "list", "object": "table"}
    bounds = [
        f"{sign} {value[name]:g}"
        for name, sign in (("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"), ("exclusiveMaximum", "<"))
        if name in value
    ]
    return " ".join([words.get(value.get("type", ""), value.get("type", "value")), ", ".join(bounds)]).strip()


def _orders() -> Iterator[tuple[str, ...]]:
    for path in sorted((ROOT / "cases").glob("*/accuracy.json")):
        stored = json.loads(path.read_text())
        for parameter, fit in stored["fits"].items():
            for error, found in fit["errors"].items():
                theory = "" if found["theory"] is None else f"{found['theory']:g}"
                link = f"[{path.parent.name}](../../cases/{path.parent.name}/README.md)"
                yield link, parameter, stored["errors"].get(error, error), f"{found['order']:.2f}", theory


def _tests() -> Iterator[tuple[str, str]]:
    for path in sorted((ROOT / "tests/verification").glob("test_*.py")):
        yield f"`{path.stem.removeprefix('test_')}`", _docstring(path)


def _docstring(path: Path) -> str:
    """Return the first paragraph of a module's docstring."""
    words = ast.get_docstring(ast.parse(path.read_text())) or ""
    return " ".join(words.partition("\n\n")[0].split())


def _title(path: Path) -> str:
    return path.read_text().partition("\n")[0].lstrip("# ")


def _first_table(text: str) -> list[str]:
    """Return the first table under "Results", without pictures; empty where there is none."""
    lines = text.partition("\n## Results\n")[2].splitlines()
    start = next((k for k, line in enumerate(lines) if line.startswith("|")), None)
    if start is None or any(line.startswith("## ") for line in lines[:start]):
        return []
    end = next((k for k in range(start, len(lines)) if not lines[k].startswith("|")), len(lines))
    return lines[start:end]


def _words(described: dict) -> str:
    """Return a docstring as Markdown."""
    text = (described.get("description") or "").replace("``", "`")
    return re.sub(r"\n +", "\n", text)


def _rows(head: Iterable[str], rows: Iterable[tuple[str, ...]]) -> Iterator[str]:
    """Yield a table in Markdown; nothing where it has no rows."""
    cells = [[cell.replace("|", r"\|") for cell in row] for row in rows]
    if cells:
        head = list(head)
        yield from ("| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *cells))
        yield ""


def _inline_equation(writer: Any, node: nodes.math) -> None:
    writer.body.append(tex2mathml(node.astext()))
    raise nodes.SkipNode


def _equation(writer: Any, node: nodes.math_block) -> None:
    writer.body.append(f'<div class="math">{tex2mathml(node.astext(), as_block=True)}</div>')
    raise nodes.SkipNode


def _leave(writer: Any, node: nodes.Node) -> None:
    """Do nothing: an equation is written when it is entered."""


def _lead_to_first_page(app: Any, error: Exception | None) -> None:
    """Let the site's folder open at its first page."""
    if error is None and app.builder.format == "html":
        page = '<!doctype html><meta http-equiv="refresh" content="0; url=docs/index.html"><title>reflowshock</title>\n'
        (Path(app.outdir) / "index.html").write_text(page)
