"""Rendering of pages from templates, safe against markup in cases, files and error messages.

Texts are escaped. The content security policy of each page allows only its own script and style, by their digests, and
embedded pictures.
"""

import base64
import hashlib
from functools import cache
from pathlib import Path

import jinja2
from markupsafe import Markup

from reflowshock.workflow.process.terminal import visible
from reflowshock.workflow.report.page_data import PageData

TEMPLATES = Path(__file__).parent / "templates"
ASSETS = Path(__file__).parent / "assets"
SCRIPTS = (
    "uplot.min.js", "ogl.min.js", "page.js", "charts.js", "shaders.js", "surfaces.js", "controls.js", "viewer.js",
    "start.js",
)  # fmt: skip
STYLES = ("uplot.min.css", "style.css")


def write_page(path: Path, template: str, context: dict) -> None:
    """Render a page from a template, write it under a temporary name and rename it.

    Args:
        path: HTML file to write; an existing one is replaced.
        template: Name of the template.
        context: Values of the template's variables by name.
    """
    environment = template_environment(TEMPLATES)
    environment.globals |= {"data": PageData(), "script": script(), "style": style(), "policy": policy()}
    partial = path.with_name(f".{path.name}.partial")
    partial.write_text(environment.get_template(template).render(context), encoding="utf-8", errors="backslashreplace")
    partial.rename(path)


def template_environment(folder: Path) -> jinja2.Environment:
    """Return the environment of the templates of a folder, which escapes texts and shows control characters.

    Args:
        folder: Folder of the template files, which is read.
    """
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        autoescape=True,
        finalize=_with_visible_controls,
        undefined=jinja2.ChainableUndefined,
        trim_blocks=True,
        extensions=["jinja2.ext.do"],
    )


@cache
def script() -> Markup:
    """Return the JavaScript, as safe HTML text, that draws charts and scenes in a page."""
    return Markup("\n".join((ASSETS / name).read_text(encoding="utf-8") for name in SCRIPTS))


@cache
def style() -> Markup:
    """Return the CSS of a page, as safe HTML text."""
    return Markup("\n".join((ASSETS / name).read_text(encoding="utf-8") for name in STYLES))


def policy() -> str:
    """Return the content security policy of a page as text: browsers run only its own script and style."""
    return f"default-src 'none'; script-src {_digest(script())}; style-src {_digest(style())}; img-src data:"


def _digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def _with_visible_controls(value: object) -> object:
    return visible(value) if isinstance(value, str) and not isinstance(value, Markup) else value
