"""Command stress-test: reads hard cases, runs them with pytest, prints each verdict and writes the page."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from reflowshock.cases.hard.collector import HARD
from reflowshock.cases.hard.hard_case import HardCase, read_hard_cases
from reflowshock.cases.hard.random_cases import read_random_file, shares
from reflowshock.cases.hard.trial import FAMILIES
from reflowshock.cases.hard.verdict import Verdict
from reflowshock.names import find_nearest
from reflowshock.problem import Problem
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.process.terminal import console
from reflowshock.workflow.store.folders import lock_folder
from reflowshock.workflow.stress_test.page import write_results
from reflowshock.workflow.stress_test.sample import Sample
from reflowshock.workflow.stress_test.session import Session
from reflowshock.workflow.stress_test.words import show_sample, show_table, show_verdict

RANDOM_COUNT = 200


@dataclass(frozen=True, slots=True)
class Request:
    """Options of a stress test.

    Attributes:
        files: Files of hard cases; empty for all shipped files.
        families: Families to run; empty for all.
        count: Number of random cases in all families together.
        seed: Seed of the random cases.
        cores: Number of simultaneous cases.
        out: Output folder.
    """

    files: Sequence[Path]
    families: Sequence[str]
    count: int
    seed: int
    cores: int
    out: Path


def stress_test(request: Request) -> bool:
    """Run fixed and random hard cases, print their verdicts, and write pages and tables to the output folder.

    Args:
        request: Cases, families, number and seed of random cases, cores and output folder.

    Returns:
        Whether all cases stay within their bounds.

    Raises:
        CaseError: A case is invalid or results cannot be written; raised before any case runs.
        RunFolderBusy: Another stress test uses the output folder.
    """
    families = _families(request.families)
    fixed = {path: read_hard_cases(path) for path in _files(request.files) if read_random_file(path) is None}
    fixed = {path: cases for path, cases in fixed.items() if cases[0].family in families}
    samples = list(_samples(request, families))
    if not fixed and not samples:
        raise CaseError("stress-test", [Problem("", "no case to run", None, "families " + ", ".join(FAMILIES))])
    with lock_folder(request.out, "stress test", "hard cases"):
        verdicts = _try_all(request, fixed, samples)
        show_table(verdicts, samples)
        write_results(request.out, verdicts, samples, request.seed)
    console.print(f"page: {request.out / 'stress_test.html'}")
    return all(verdict.ok for verdict in verdicts) and all(sample.ok for sample in samples)


def _try_all(request: Request, fixed: Mapping[Path, list[HardCase]], samples: Sequence[Sample]) -> list[Verdict]:
    """Run all cases; return the verdicts on fixed cases and add verdicts and counterexamples to the samples."""
    verdicts: list[Verdict] = []
    by_name = {sample.name: sample for sample in samples}

    def report(verdict: Verdict) -> None:
        if not verdict.case.may_be_refused:
            verdicts.append(verdict)
            show_verdict(verdict)
            return
        sample = by_name[verdict.case.name]
        sample.completed.append(verdict)
        if len(sample.completed) == len(sample.cases):
            show_sample(sample)

    session = Session(request.cores, request.seed, {sample.name: len(sample.cases) for sample in samples})
    session.attempt({**fixed, **{sample.file.path: sample.cases for sample in samples}}, report)
    missed = {sample.file.path: sample.cases.index(sample.missed[0].case) for sample in samples if sample.missed}
    simplest = session.simplest(missed) if missed else {}
    for path, number in missed.items():
        sample = by_name[path.stem]
        sample.simplest = sample.file.file_table(simplest.get(sample.name, sample.cases[number].table))
    return verdicts


def _files(paths: Sequence[Path]) -> list[Path]:
    """Return the chosen files, or all shipped files."""
    return list(paths) or sorted(HARD.glob("*.toml"))


def _samples(request: Request, families: Sequence[str]) -> Iterator[Sample]:
    """Draw random cases of each family from the shipped files."""
    files = [file for path in _files(()) if (file := read_random_file(path)) is not None]
    for position, family in enumerate(families):
        count = request.count * (position + 1) // len(families) - request.count * position // len(families)
        for file, share in shares([file for file in files if file.table["family"] == family], count):
            yield Sample(file, file.cases(share, request.seed))


def _families(names: Sequence[str]) -> list[str]:
    for family in names:
        if family not in FAMILIES:
            choice, hint = "one of " + ", ".join(FAMILIES), find_nearest(family, FAMILIES)
            raise CaseError("stress-test", [Problem("--family", "unknown family", family, choice, hint)])
    return [family for family in FAMILIES if not names or family in names]
