"""The command stress-test: reads the cases, tries them, tells each verdict and writes picture, page and JSON."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from reflowshock.names import nearest
from reflowshock.problem import Problem
from reflowshock.workflow.case.case import CASES
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.process.terminal import console
from reflowshock.workflow.store.folders import locked
from reflowshock.workflow.stress_test.families import FAMILIES, random_trials
from reflowshock.workflow.stress_test.hard_case import HardCase, read_hard_cases
from reflowshock.workflow.stress_test.pool import Pool
from reflowshock.workflow.stress_test.results import write_results
from reflowshock.workflow.stress_test.sample import Sample, try_sample
from reflowshock.workflow.stress_test.verdict import Verdict
from reflowshock.workflow.stress_test.verdict_text import show_sample, show_table, show_verdict

HARD = CASES / "hard"
RANDOM_COUNT = 200


@dataclass(frozen=True, slots=True)
class Request:
    """What the user asks for.

    Attributes:
        files: of fixed cases; none means all that the program has.
        families: of which; none means all.
        count: of random cases, over all these families.
        seed: of the random cases.
        cores: how many are tried at a time.
        out: folder of the results.
    """

    files: Sequence[Path]
    families: Sequence[str]
    count: int
    seed: int
    cores: int
    out: Path


def stress_test(request: Request) -> bool:
    """Try hard cases, then random ones; write the results.

    Returns:
        Whether all survived within their bounds.

    Raises:
        CaseError: a case cannot be tried, or results cannot be written; nothing was.
        RunFolderBusy: another stress test is at work in the folder of the results.
    """
    families = _families(request.families)
    cases = fixed_cases(request.files, families)
    if not cases and not request.count:
        raise CaseError("stress-test", [Problem("", "no case to try", None, "families " + ", ".join(FAMILIES))])
    with locked(request.out, "stress test", "hard cases"):
        return _try_all(request, families, cases)


def _try_all(request: Request, families: Sequence[str], cases: Sequence[HardCase]) -> bool:
    """Try fixed cases, then random ones of each family; as ``stress_test``."""
    verdicts: list[Verdict] = []
    samples: list[Sample] = []
    with Pool(request.cores) as pool:
        for verdict in pool.attempt(cases):
            show_verdict(verdict)
            verdicts.append(verdict)
        own = [family for family in families if random_trials(family)]
        for position, family in enumerate(own):
            count = request.count * (position + 1) // len(own) - request.count * position // len(own)
            for sample in try_sample(family, count, request.seed, pool):
                show_sample(sample)
                samples.append(sample)
    show_table(verdicts, samples)
    write_results(request.out, verdicts, samples, request.seed)
    console.print(f"page: {request.out / 'stress_test.html'}")
    return all(verdict.ok for verdict in verdicts) and all(sample.ok for sample in samples)


def fixed_cases(files: Sequence[Path], families: Sequence[str]) -> list[HardCase]:
    """Read cases from files, or all that the program has, of some families."""
    paths = list(files) or sorted(HARD.glob("*.toml"))
    found = [case for path in paths for case in read_hard_cases(path)]
    return [case for case in found if case.family in families]


def _families(wanted: Sequence[str]) -> list[str]:
    for family in wanted:
        if family not in FAMILIES:
            choice, hint = "one of " + ", ".join(FAMILIES), nearest(family, FAMILIES)
            raise CaseError("stress-test", [Problem("--family", "unknown family", family, choice, hint)])
    return [family for family in FAMILIES if not wanted or family in wanted]
