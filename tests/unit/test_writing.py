"""Wording of the project: phrases to avoid, length of documents, subjects of commits."""

import ast
import re
import shutil
import subprocess
import sys
import tomllib
from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
RULES = tomllib.loads((ROOT / "tests/phrases.toml").read_text(encoding="utf-8"))
PATTERNS = {phrase["name"]: re.compile(phrase["pattern"]) for phrase in RULES["phrases"]}
INSTEAD = {phrase["name"]: phrase["instead"] for phrase in RULES["phrases"]}
FOLDERS = ("reflowshock", "workflow", "meshing", "particles", "fem", "cases", "benchmarks", "tests", "docs")
COMMENT = re.compile(r"(?:^\s*|  )# ?(?!!)(.*)")
NOT_A_VERB = {"A", "An", "The", "This", "What", "How", "Where", "Which", "Why"}


@cache
def files(suffix: str) -> list[Path]:
    """Return the files of the project; folders of ``reflowshock`` that are links are listed once."""
    below = [path for folder in FOLDERS for path in (ROOT / folder).rglob(f"*{suffix}")]
    return [*ROOT.glob(f"*{suffix}"), *(path for path in below if "generated" not in path.parts)]


def texts(path: Path) -> Iterator[tuple[int, str]]:
    """Yield line number and text of the Markdown lines, or of the docstrings, literals and comments, of a file."""
    source = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        is_code = False
        for number, line in enumerate(source.splitlines(), 1):
            is_code ^= line.lstrip().startswith("```")
            if not is_code and not line.startswith("    "):
                yield number, line
        return
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value.strip():
            yield node.lineno, node.value
    for number, line in enumerate(source.splitlines(), 1):
        if comment := COMMENT.search(line):
            yield number, comment[1]


def room(path: Path) -> str:
    """Return the folder that a file is counted under, two levels deep."""
    return "/".join(path.relative_to(ROOT).parts[:-1][:2]) or "top level"


def hits(path: Path, number: int, text: str) -> list[str]:
    """Return one line of report for each phrase in a text."""
    where = f"{path.relative_to(ROOT)}:{number}"
    return [
        f"{where}: {match[0]!r} ({name}); try: {INSTEAD[name]}"
        for name, pattern in PATTERNS.items()
        for match in pattern.finditer(text)
    ]


def test_phrases():
    """Texts avoid the listed phrases, in each room and in all."""
    words, lines = Counter(), defaultdict(list)
    for path in files(".py") + files(".md"):
        for number, text in texts(path):
            words[room(path)] += len(text.split())
            lines[room(path)] += hits(path, number, text)
    limits = RULES["limits"]
    for place, report in lines.items():
        allowed = limits["room"] * max(words[place], limits["smallest_room"]) / 1e4
        assert len(report) <= allowed, "\n".join([f"{place}: more than {allowed:.0f} phrases", *report])
    every = [line for report in lines.values() for line in report]
    assert len(every) <= limits["overall"] * words.total() / 1e4, "\n".join(every)


def test_phrases_are_found(tmp_path):
    """Docstrings, literals, comments and Markdown are read; code is not."""
    module = tmp_path / "module.py"
    module.write_text('"""Mesh anew."""\nanew = "run anew"  # started anew\n# built anew\n')
    page = tmp_path / "page.md"
    page.write_text("Meshed anew.\n\n    code anew\n```\ncode anew\n```\n")
    assert [number for number, text in texts(module) if PATTERNS["anew"].search(text)] == [1, 2, 2, 3]
    assert [number for number, text in texts(page) if PATTERNS["anew"].search(text)] == [1]


def test_length_of_documents():
    """Documents are short: all of them, the README of a room or a case, and the architecture."""
    limits = RULES["documents"]
    lengths = {path: len(path.read_text(encoding="utf-8").split()) for path in files(".md")}
    assert sum(lengths.values()) <= limits["all"]
    assert lengths[ROOT / "ARCHITECTURE.md"] <= limits["architecture"]
    assert len(limits["long"]) <= 8
    long = {ROOT / folder / "README.md" for folder in limits["long"]}
    readmes = {path: count for path, count in lengths.items() if path.name == "README.md" and path.parent != ROOT}
    assert long <= set(readmes)
    too_long = {
        str(path.relative_to(ROOT)): count
        for path, count in readmes.items()
        if count > limits["long_readme" if path in long else "readme"]
    }
    assert not too_long


def subjects() -> list[str]:
    """Return the subjects of the commits that are checked, as far as the history is here."""
    if not (shutil.which("git") and (ROOT / ".git").exists()):
        return []
    since = f"--since={RULES['commits']['since'].isoformat()}"
    log = ["git", "-C", str(ROOT), "log", "--no-merges", "--format=%s", since]
    return subprocess.run(log, capture_output=True, text=True, check=False).stdout.splitlines()


def not_imperative(lines: list[str], folder: Path) -> list[str]:
    """Return the subjects that do not start with an imperative, by Ruff's rule for docstrings."""
    functions = [f"def f{k}():\n    {line.rstrip('.') + '.'!r}\n" for k, line in enumerate(lines)]
    (folder / "subjects.py").write_text("\n".join(functions), encoding="utf-8")
    options = ("--isolated", "--no-cache", "--select=D401", "--output-format=concise")
    ruff = [sys.executable, "-m", "ruff", "check", *options]
    result = subprocess.run([*ruff, "subjects.py"], cwd=folder, capture_output=True, text=True, check=False)
    assert result.returncode in (0, 1), result.stderr
    wrong = {(int(number) - 2) // 3 for number in re.findall(r"subjects\.py:(\d+):", result.stdout)}
    return [
        line for k, line in enumerate(lines)
        if k in wrong or line.split()[0] in NOT_A_VERB or line.split()[0].endswith(":")
    ]  # fmt: skip


def test_commit_subjects(tmp_path):
    """Subjects of commits are imperative and short."""
    lines = subjects()
    if not lines:
        pytest.skip("no checked commit is in the history, or git is missing")
    assert not [line for line in lines if len(line) > RULES["commits"]["subject"]]
    assert not not_imperative(lines, tmp_path)


def test_imperative_is_recognised(tmp_path):
    wrong = ["Adds a load", "Changelog: rest", "What a load costs", "Tested with 'quotes' and \"quotes\""]
    assert not_imperative(["Add a load", *wrong, "Reject overlapping pads"], tmp_path) == wrong
