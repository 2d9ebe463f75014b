"""Commands on the site: commands of its pages and of the READMEs, which are also pages."""

import re
from collections.abc import Iterator
from pathlib import Path

from tests.support.command_parser import commands

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
FENCE = re.compile(r"^```bash\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INDENTED = re.compile(r"^    (\S.*)$", re.MULTILINE)
OURS = re.compile(rf"^(\S*/)?reflowshock ({'|'.join(commands())}|--)")


def pages() -> list[Path]:
    """Return the paths of the hand-written pages of the site, sorted."""
    return sorted(path for path in DOCS.rglob("*.md") if path.parent.name != "generated")


def shown(page: Path) -> list[str]:
    """Return the command lines in the code blocks of a page in order, without comments."""
    lines = "".join(FENCE.findall(page.read_text())).splitlines()
    return [line.partition("  #")[0].rstrip() for line in lines]


def in_readmes() -> Iterator[tuple[Path, str]]:
    """Yield page and command line of each command of the program in the Markdown pages of top folder and rooms."""
    rooms = ("benchmarks", "cases", "fem", "meshing", "particles", "workflow")
    for path in (*ROOT.glob("*.md"), *(page for room in rooms for page in (ROOT / room).rglob("*.md"))):
        for line in INDENTED.findall(path.read_text()):
            if OURS.match(line):
                yield path, line.partition("  #")[0].rstrip()
