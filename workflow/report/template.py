"""How pages are made from templates: nothing that a case, a file or an error says becomes a part of the page's code."""

from pathlib import Path

import jinja2
from markupsafe import Markup

from reflowshock.workflow.process.terminal import visible

TEMPLATES = Path(__file__).parent / "templates"


def write_page(path: Path, template: str, context: dict) -> None:
    """Write a page from one of the templates, under a temporary name, then rename it."""
    environment = template_environment(TEMPLATES)
    partial = path.with_name(f".{path.name}.partial")
    partial.write_text(environment.get_template(template).render(context), encoding="utf-8", errors="backslashreplace")
    partial.rename(path)


def template_environment(folder: Path) -> jinja2.Environment:
    """Return what renders the templates of a folder: texts are escaped, their control characters visible."""
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        autoescape=True,
        finalize=_shown,
        undefined=jinja2.ChainableUndefined,
        trim_blocks=True,
    )


def _shown(value: object) -> object:
    return visible(value) if isinstance(value, str) and not isinstance(value, Markup) else value
