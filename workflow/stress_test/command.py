"""The command stress-test: reads the cases, lets pytest try them, tells each verdict and writes the page."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from reflowshock.cases.hard.collector import HARD
from reflowshock.cases.hard.hard_case import HardCase, read_hard_cases
from reflowshock.cases.hard.random_cases import read_random_file, shares
from reflowshock.cases.hard.trial import FAMILIES
from reflowshock.cases.hard.verdict import Verdict
from reflowshock.names import nearest
from reflowshock.problem import Problem
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.process.terminal import console
from reflowshock.workflow.store.folders import locked
from reflowshock.workflow.stress_test.page import write_results
from reflowshock.workflow.stress_test.sample import Sample
from reflowshock.workflow.stress_test.session import Session
from reflowshock.workflow.stress_test.words import show_sample, show_table, show_verdict

RANDOM_COUNT = 200


@dataclass(frozen=True, slots=True)
class Request:
    """Request of the user.

    Attributes:
        files: of cases; none means all that the program has.
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
    fixed = {path: read_hard_cases(path) for path in _files(request.files) if read_random_file(path) is None}
    fixed = {path: cases for path, cases in fixed.items() if cases[0].family in families}
    samples = list(_samples(request, families))
    if not fixed and not samples:
        raise CaseError("stress-test", [Problem("", "no case to try", None, "families " + ", ".join(FAMILIES))])
    with locked(request.out, "stress test", "hard cases"):
        verdicts = _try_all(request, fixed, samples)
        show_table(verdicts, samples)
        write_results(request.out, verdicts, samples, request.seed)
    console.print(f"page: {request.out / 'stress_test.html'}")
    return all(verdict.ok for verdict in verdicts) and all(sample.ok for sample in samples)


def _try_all(request: Request, fixed: Mapping[Path, list[HardCase]], samples: Sequence[Sample]) -> list[Verdict]:
    """Try all; return the verdicts on fixed cases, and let samples have theirs and the simplest that misses."""
    verdicts: list[Verdict] = []
    by_name = {sample.name: sample for sample in samples}

    def tell(verdict: Verdict) -> None:
        if not verdict.case.may_be_refused:
            verdicts.append(verdict)
            show_verdict(verdict)
            return
        sample = by_name[verdict.case.name]
        sample.found.append(verdict)
        if len(sample.found) == len(sample.cases):
            show_sample(sample)

    session = Session(request.cores, request.seed, {sample.name: len(sample.cases) for sample in samples})
    session.attempt({**fixed, **{sample.file.path: sample.cases for sample in samples}}, tell)
    missed = {sample.file.path: sample.cases.index(sample.missed[0].case) for sample in samples if sample.missed}
    simplest = session.simplest(missed) if missed else {}
    for path, number in missed.items():
        sample = by_name[path.stem]
        sample.simplest = sample.file.file_table(simplest.get(sample.name, sample.cases[number].table))
    return verdicts


def _files(given: Sequence[Path]) -> list[Path]:
    """Return the files that are given, or all that the program has."""
    return list(given) or sorted(HARD.glob("*.toml"))


def _samples(request: Request, families: Sequence[str]) -> Iterator[Sample]:
    """Draw random cases of each family, from the program's own files."""
    files = [file for path in _files(()) if (file := read_random_file(path)) is not None]
    for position, family in enumerate(families):
        count = request.count * (position + 1) // len(families) - request.count * position // len(families)
        for file, own in shares([file for file in files if file.table["family"] == family], count):
            yield Sample(file, file.cases(own, request.seed))


def _families(wanted: Sequence[str]) -> list[str]:
    for family in wanted:
        if family not in FAMILIES:
            choice, hint = "one of " + ", ".join(FAMILIES), nearest(family, FAMILIES)
            raise CaseError("stress-test", [Problem("--family", "unknown family", family, choice, hint)])
    return [family for family in FAMILIES if not wanted or family in wanted]
