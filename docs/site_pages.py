"""Sphinx extension that generates reference pages from the checkout and renders equations as MathML.

Pages are written to ``docs/generated``: gallery, keys of case files, commands, validation figures, benchmarks, rooms.
Nothing is computed here: every figure comes from a README or a stored result.
"""

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from measured_tables import accuracy_tables, benchmark_tables, table

from reflowshock.workflow.effects.registry import registry
from reflowshock.workflow.examples import EXAMPLES
from reflowshock.workflow.kinds import KINDS
from reflowshock.workflow.pipeline.schema import case_schema

ROOT = Path(__file__).resolve().parent.parent
CASES = sorted(path for path in (ROOT / "cases").glob("*/README.md") if path.parent.name != "hard")
PACKAGES = ("fem", "particles", "meshing", "workflow")


def setup(app: Any) -> dict:
    """Write the generated pages and register the renderer of equations; Sphinx calls it when it loads the extension.

    Args:
        app: Sphinx application.

    Returns:
        Properties of the extension for Sphinx.
    """
    write_pages(ROOT / "docs/generated")
    app.add_html_math_renderer("mathml", (_inline_equation, _leave), (_equation, _leave))
    app.connect("html-page-context", lambda *event: event[3].update(sourcename=""))
    app.connect("build-finished", _lead_to_first_page)
    return {"parallel_read_safe": True}


def write_pages(folder: Path) -> None:
    """Write every generated page that has changed as ``NAME.md`` into a folder, which is created if it is missing."""
    folder.mkdir(exist_ok=True)
    pages = {"gallery": gallery(), "keys": keys(), "commands": commands(), "figures": figures(), "rooms": rooms()}
    pages |= {"effects": effects(), "benchmarks": benchmark_tables(), "accuracy": accuracy_tables()}
    for name, lines in pages.items():
        text = "\n".join(lines) + "\n"
        path = folder / f"{name}.md"
        if not path.exists() or path.read_text() != text:  # Sphinx rebuilds a page whose file is newer
            path.write_text(text)


def gallery() -> Iterator[str]:
    """Yield the Markdown lines of a page with a section for each case that has pictures."""
    yield from ("# Gallery", "", "Pictures of the cases that ship with the program.", "")
    for path in CASES:
        pictures = re.findall(r"!\[([^\]]+)\]\(([\w.]+)\)", path.read_text())
        if not pictures:
            continue
        folder = f"../../cases/{path.parent.name}"
        yield from (f"## [{_title(path)}]({folder}/README.md)", "")
        for caption, file in pictures:
            yield from (f"![{caption}]({folder}/{file})", "", f"*{caption[0].upper()}{caption[1:]}.*", "")


def keys() -> Iterator[str]:
    """Yield the Markdown lines of the reference of all keys: a section for each table of each kind of case."""
    schema = case_schema()
    yield from ("# Keys of case files", "")
    yield 'Generated from `reflowshock schema`. A quantity is a string with a unit, such as `"0.48 mm"`;'
    yield from ("a key without a default is required. NAME stands for a name that you choose.", "")
    for kind, definition in zip(KINDS, schema["anyOf"], strict=True):
        yield from (f"## Cases of kind {kind.case.kind}", "", _words(definition), "")
        for name, entry in _tables(definition, schema["$defs"], ""):
            if name:
                yield from (f"### {name}", "", _words(entry), "")
            yield from table(("key", "values", "default"), _keys_of(entry, schema["$defs"]))


def commands() -> Iterator[str]:
    """Yield the Markdown lines of a page with a section for each command: its purpose and examples."""
    from typer.main import get_command

    from reflowshock.workflow.cli import app

    yield from ("# Commands", "", "`reflowshock COMMAND --help` lists the options.", "")
    for name, command in get_command(app).commands.items():
        if not command.hidden:
            yield from (f"## {name}", "", _words({"description": command.help}), "")
            yield from ("```bash", *EXAMPLES[name], "```", "")


def effects() -> Iterator[str]:
    """Yield the Markdown lines of the table of all effects, which the page on theory includes."""
    rows = (
        (
            effect.name.replace("_", " "),
            effect.stage,
            effect.number,
            "set by the case" if effect.threshold is None else f"{effect.acts} {effect.threshold:g}",
            effect.source,
        )
        for effect in registry().values()
    )
    yield from table(("effect", "stage", "number", "acts", "source"), rows)


def figures() -> Iterator[str]:
    """Yield the Markdown lines of a page with fitted orders, results of each case, and tests against exact values."""
    yield from ("# Figures of validation", "", "## Orders of convergence", "")
    yield "Fitted by `reflowshock accuracy`, stored in `accuracy.json` of the case: $e(h) = C h^p$ with the order $p$."
    yield from ("", *table(("case", "parameter", "error", "order", "theory"), _orders()))
    yield from ("## Results of the cases", "")
    for path in CASES:
        if lines := _first_table(path.read_text()):
            yield from (f"### [{_title(path)}](../../cases/{path.parent.name}/README.md)", "", *lines, "")
    yield from ("## Tests against exact solutions and other programs", "")
    yield from ("`make test` runs each of these; they are in `tests/verification`.", "")
    yield from table(("test", "compares"), _tests())


def rooms() -> Iterator[str]:
    """Yield the Markdown lines of a page with the contents of each room (folder) of the program, from its docstring."""
    yield from ("# Rooms", "", "Folders of the program and their contents.", "")
    for package in PACKAGES:
        yield from (f"## [{package}](../../{package}/README.md)", "")
        paths = sorted((ROOT / package).glob("*/__init__.py"))
        yield from table(("room", "contents"), ((f"`{path.parent.name}`", _docstring(path)) for path in paths))


def _tables(node: dict, defs: dict, name: str) -> Iterator[tuple[str, dict]]:
    """Yield dotted name and definition of a table and of its subtables, those with names of the user last."""
    yield name, node
    tables = sorted(node.get("properties", {}).items(), key=lambda item: "additionalProperties" in item[1])
    for key, value in tables:
        inner = f"{name}.{key}".lstrip(".")
        for is_named_by_user, reference in _references(value):
            definition = defs[reference]
            kind = definition["properties"].get("kind", {}).get("const")
            suffix = (".NAME" if is_named_by_user else "") + (f" (kind {kind})" if kind else "")
            yield from _tables(definition, defs, inner + suffix)


def _references(value: dict) -> list[tuple[bool, str]]:
    """Return the names of the definitions of a key's table, each with whether the user names such tables."""
    inside = value.get("additionalProperties")
    is_named_by_user = isinstance(inside, dict)
    choices = inside if is_named_by_user else value
    members = choices.get("anyOf") or choices.get("oneOf") or [choices]
    return [(is_named_by_user, member["$ref"].rpartition("/")[2]) for member in members if "$ref" in member]


def _keys_of(definition: dict, defs: dict) -> Iterator[tuple[str, str, str]]:
    required = definition.get("required", ())
    for name, value in definition.get("properties", {}).items():
        if name == "scales" or _references(value):
            continue
        default = "required" if name in required else _default(value)
        yield f"`{name}`", _values(value), default


def _default(value: dict) -> str:
    default = value.get("default")
    if default is None:
        return ""
    return f"`{default if isinstance(default, str) and default else json.dumps(default)}`"


def _values(value: dict) -> str:
    """Return the allowed values of a key, as its schema has them."""
    if "description" in value:
        return value["description"]
    if "enum" in value or "const" in value:
        return ", ".join(f"`{name}`" for name in value.get("enum", [value.get("const")]))
    if "oneOf" in value:
        return "a table of kind " + ", ".join(f"`{name}`" for name in value["discriminator"]["mapping"])
    if "anyOf" in value:
        return " or ".join(_values(choice) for choice in value["anyOf"] if choice.get("type") != "null")
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
            for error, order in fit["errors"].items():
                theory = "" if order["theory"] is None else f"{order['theory']:g}"
                link = f"[{path.parent.name}](../../cases/{path.parent.name}/README.md)"
                yield link, parameter, stored["errors"].get(error, error), f"{order['order']:.2f}", theory


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
    """Return the lines of the first table under "Results", or an empty list."""
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


def _inline_equation(writer: Any, node: nodes.math) -> None:
    writer.body.append(tex2mathml(node.astext()))
    raise nodes.SkipNode


def _equation(writer: Any, node: nodes.math_block) -> None:
    writer.body.append(f'<div class="math">{tex2mathml(node.astext(), as_block=True)}</div>')
    raise nodes.SkipNode


def _leave(writer: Any, node: nodes.Node) -> None:
    """Do nothing: entering an equation writes all of it."""


def _lead_to_first_page(app: Any, error: Exception | None) -> None:
    """Write a page that redirects from the site's folder to its first page."""
    if error is None and app.builder.format == "html":
        page = '<!doctype html><meta http-equiv="refresh" content="0; url=docs/index.html"><title>reflowshock</title>\n'
        (Path(app.outdir) / "index.html").write_text(page)
