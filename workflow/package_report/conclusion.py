"""Conclusions of a board drop: verdict, discretisation error, warnings and a one-line answer."""

from collections.abc import Mapping
from pathlib import Path

from reflowshock.fem.estimates.drop_effects import Failing
from reflowshock.workflow.board_drop.duration import longest_duration
from reflowshock.workflow.case.run import metric
from reflowshock.workflow.package import findings, reference
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.report.errors import Discretisation
from reflowshock.workflow.report.histories import Arrays, late_peak, read_modes, unsettled
from reflowshock.workflow.verdict.answer import answer
from reflowshock.workflow.verdict.criterion import JudgedDrop
from reflowshock.workflow.verdict.verdict import verdict_of

PEEL = "peel_stress"


def conclude(run_folder: Path, case: BoardDropCase, summary: dict, known: Discretisation) -> None:
    """Add verdict, warnings, answer and discretisation errors to the summary of a run, if the shock was run.

    Args:
        run_folder: Folder of the run, from which histories and results of the shock are read.
        case: Case with the failure limits.
        summary: Content of ``summary.json``, changed in place: ``verdict``, ``warnings``, ``answer`` (one line of
            text), ``errors`` and, if it is known, the metric ``discretisation_error`` are added.
        known: Discretisation errors of the metrics.
    """
    histories, results = read_modes(run_folder / "shock")
    if not histories or "critical_joint" not in summary["metrics"]:
        return
    main = next(iter(histories))
    summary["effects"][Failing.name] = Failing.by_limits(case.shock.failure)
    coarse = _coarse(results[main], histories[main]["joints"])
    summary["errors"] = known.record(results)
    survivor = reference.metrics_of(case.shock.failure.reference)
    verdict = verdict_of(JudgedDrop(case, summary["metrics"], histories[main], coarse, survivor))
    if PEEL in known.errors:
        summary["metrics"]["discretisation_error"] = metric(known.errors[PEEL])
    deciding = verdict["joints"][verdict["joint"]]["criterion"]
    summary |= {
        "verdict": verdict,
        "warnings": [warning for warning in _warnings(case, histories[main]) if warning],
        "answer": answer(verdict, known.errors.get(deciding), known.how.get(deciding, known.unknown)),
    }


def _warnings(case: BoardDropCase, history: Arrays) -> tuple[str, ...]:
    """Return warnings of a stress that may still rise after the end of the run."""
    if case.shock.duration == "auto":
        return (unsettled(history, longest_duration(case)),)
    return (late_peak(history),)


def _coarse(result: Mapping, joints) -> list[str]:
    """Return the names of the joints with the coarse mesh."""
    fine = findings.fine_joints_of(result)
    return [] if fine is None else [str(name) for name in joints if str(name) not in fine]
