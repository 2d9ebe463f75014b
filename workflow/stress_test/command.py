"""The command stress-test: reads the cases, tries them, tells each verdict and writes picture, page and JSON."""

from collections.abc import Sequence
from pathlib import Path

from workflow.case_text import CASES
from workflow.problems import CaseError, Problem
from workflow.stress_test.families import FAMILIES
from workflow.stress_test.hard_case import HardCase, read_hard_cases
from workflow.stress_test.pool import Pool
from workflow.stress_test.verdict import Verdict
from workflow.stress_test.verdict_text import show_table, show_verdict

HARD = CASES / "hard"


def stress_test(files: Sequence[Path], families: Sequence[str], cores: int, out: Path) -> bool:
    """Try hard cases.

    Args:
        files: of cases; where there are none, all that the program has.
        families: of which; empty means all.
        cores: how many are tried at a time.
        out: folder of the results.

    Returns:
        Whether all survived within their bounds.

    Raises:
        CaseError: a case cannot be tried; nothing was.
    """
    cases = fixed_cases(files, families)
    verdicts: list[Verdict] = []
    with Pool(cores) as pool:
        for verdict in pool.attempt(cases):
            show_verdict(verdict)
            verdicts.append(verdict)
    show_table(verdicts)
    return all(verdict.ok for verdict in verdicts)


def fixed_cases(files: Sequence[Path], families: Sequence[str]) -> list[HardCase]:
    """Read cases from files, or all that the program has, of some families or all."""
    paths = list(files) or sorted(HARD.glob("*.toml"))
    found = [case for path in paths for case in read_hard_cases(path)]
    cases = [case for case in found if not families or case.family in families]
    if not cases:
        raise CaseError("stress-test", [Problem("", "no case to try", None, "families " + ", ".join(FAMILIES))])
    return cases
