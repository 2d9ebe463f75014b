"""Results of a stress test: stress_test.json, .png and .html, and a TOML file for each counterexample."""

import base64
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from reflowshock.workflow import __version__
from reflowshock.workflow.report.template import template_environment
from reflowshock.workflow.stress_test.case_file import hard_case_text
from reflowshock.workflow.stress_test.families import FAMILIES
from reflowshock.workflow.stress_test.picture import draw_margins
from reflowshock.workflow.stress_test.sample import Sample
from reflowshock.workflow.stress_test.verdict import Check, Verdict
from reflowshock.workflow.stress_test.verdict_text import margin_text, said, sample_said

TEMPLATES = Path(__file__).parent / "templates"


def write_results(folder: Path, verdicts: Sequence[Verdict], samples: Sequence[Sample], seed: int) -> None:
    """Write all results to a folder; counterexamples of an earlier test stay.

    Args:
        folder: of the results.
        verdicts: of the fixed cases.
        samples: random cases.
        seed: from which they were drawn.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for sample in samples:
        if sample.simplest is not None:
            path = counterexample_path(folder, sample)
            path.parent.mkdir(exist_ok=True)
            path.write_text(hard_case_text(sample.simplest), encoding="utf-8")
    draw_margins(folder / "stress_test.png", verdicts, samples)
    told = {
        "version": __version__,
        "seed": seed,
        "fixed": [_record(verdict) for verdict in verdicts],
        "random": [_sample_record(sample) for sample in samples],
    }
    (folder / "stress_test.json").write_text(json.dumps(told, indent=1), encoding="utf-8")
    (folder / "stress_test.html").write_text(_page(folder, verdicts, samples, seed), encoding="utf-8")


def counterexample_path(folder: Path, sample: Sample) -> Path:
    """Where the simplest case of a sample that misses is written."""
    return folder / "counterexamples" / f"{sample.trial.name}.toml"


def _record(verdict: Verdict) -> dict[str, Any]:
    return {
        "name": verdict.case.name,
        "tried": verdict.case.tried,
        "family": verdict.case.family,
        "ok": verdict.ok,
        "refused": verdict.is_refused,
        "message": verdict.message,
        "seconds": round(verdict.seconds, 3),
        "checks": [_check(check) for check in verdict.checks],
    }


def _check(check: Check) -> dict[str, Any]:
    margin = check.margin if math.isfinite(check.margin) else None
    return {"measure": check.measure, "found": check.found, "bound": check.bound, "margin": margin, "ok": check.holds}


def _sample_record(sample: Sample) -> dict[str, Any]:
    tried = zip(sample.tables, sample.verdicts, strict=True)
    return {
        "name": sample.trial.name,
        "family": sample.family,
        "ok": sample.ok,
        "tried": len(sample.verdicts),
        "refused": sample.refused,
        "cases": [_record(verdict) | {"parameters": table} for table, verdict in tried],
    }


def _page(folder: Path, verdicts: Sequence[Verdict], samples: Sequence[Sample], seed: int) -> str:
    environment = template_environment(TEMPLATES)
    environment.globals.update(said=said, sample_said=sample_said, margin_text=margin_text)
    in_order = sorted(verdicts, key=lambda one: (FAMILIES.index(one.case.family), one.case.name))
    return environment.get_template("stress_test.html.j2").render(
        version=__version__,
        seed=seed,
        verdicts=in_order,
        samples=samples,
        tried=sum(len(sample.verdicts) for sample in samples),
        missed=sum(not verdict.ok for verdict in verdicts) + sum(len(sample.missed) for sample in samples),
        refused=sum(sample.too_many_refused for sample in samples),
        picture=base64.b64encode((folder / "stress_test.png").read_bytes()).decode(),
    )
