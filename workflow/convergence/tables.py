"""Tables of errors and costs with the Pareto front, for the terminal, the page, a report and Markdown."""

import shlex
from collections import Counter
from collections.abc import Mapping, Sequence

from reflowshock.problem import as_toml
from reflowshock.workflow.case.scales import override_value
from reflowshock.workflow.case.text import number, percent
from reflowshock.workflow.convergence.accuracy_file import Accuracy, Fit, Measurement


def front(costs: Sequence[float], errors: Sequence[float]) -> list[int]:
    """Return the indices of the runs on the Pareto front, the cheapest first.

    Args:
        costs: Cost of each run, in any unit.
        errors: Error of each run, in the same order.
    """
    smallest_error, indices = float("inf"), []
    for index in sorted(range(len(costs)), key=lambda k: (costs[k], errors[k])):
        if errors[index] < smallest_error:
            smallest_error = errors[index]
            indices.append(index)
    return indices


LONGEST_MESSAGE = 90
ON_FRONT = "*"
SMALLEST_ERROR = 5e-5  # smallest error that is written as a number


def all_measurements(accuracy: Accuracy) -> list[Measurement]:
    """Return the measurements of all runs of a study, including the recommended run."""
    recommended = accuracy.recommended.found if accuracy.recommended else None
    if recommended is None or recommended.run in {measurement.run for measurement in accuracy.measurements}:
        return list(accuracy.measurements)
    return [*accuracy.measurements, recommended]


def compared(accuracy: Accuracy) -> list[Measurement]:
    """Return the measurements of the judged quantity's total error; failed, reference and partial runs are left out."""
    return [m for m in all_measurements(accuracy) if accuracy.judged in m.errors and not m.against]


def on_front(accuracy: Accuracy) -> set[str]:
    """Return the names of the runs on the Pareto front of error and core-seconds."""
    measured = compared(accuracy)
    best = front([m.core_seconds for m in measured], [m.errors[accuracy.judged].value for m in measured])
    return {measured[index].run for index in best}


def runs(accuracy: Accuracy) -> dict:
    """Return the table of runs: setting, errors, costs, and a remark on an unusual reference or a failure.

    Args:
        accuracy: Convergence study.

    Returns:
        Table with ``head`` (column titles), ``rows`` (lists of text, one row per run, the cheapest first) and
        ``prose``; columns without any text are left out.
    """
    best, usual = on_front(accuracy), usual_reference(accuracy)
    head = ["setting", *(short(name) for name in accuracy.errors), "wall s", "core s", ""]
    rows = []
    for m in sorted(all_measurements(accuracy), key=lambda m: (bool(m.failed), bool(m.against), m.core_seconds)):
        errors = [_error(m.errors[name].value) if name in m.errors else "" for name in accuracy.errors]
        cost = ["", ""] if m.failed else [number(float(f"{cost:.3g}")) for cost in (m.seconds, m.core_seconds)]
        name = f"{m.run} {ON_FRONT}" if m.run in best else m.run
        rows.append([name, *errors, *cost, _remark(m, accuracy, usual)])
    last = len(head) - 1
    filled = [column for column in range(len(head)) if column in {0, last} or any(row[column] for row in rows)]
    cells = [[row[column] for column in filled] for row in rows]
    return {"head": [head[column] for column in filled], "rows": cells, "prose": True}


def _error(share: float) -> str:
    """Write an error to a hundredth of a per cent."""
    return percent(share) if share >= 0.001 else f"{100.0 * share:.2f} %" if share >= SMALLEST_ERROR else "< 0.01 %"


def remarks(accuracy: Accuracy) -> list[str]:
    """Return the remarks of the table of runs, each once: "remark: names of its runs"."""
    names_of: dict[str, list[str]] = {}
    for row in runs(accuracy)["rows"]:
        names_of.setdefault(row[-1], []).append(row[0].removesuffix(f" {ON_FRONT}"))
    return [f"{remark}: {', '.join(names)}" for remark, names in names_of.items() if remark]


def short(quantity: str) -> str:
    """Return the name of a quantity for the head of a column: without ``_error`` and underscores."""
    return quantity.removesuffix("_error").replace("_", " ")


def usual_reference(accuracy: Accuracy) -> str:
    """Return the most frequent reference of the total errors of an accuracy study, as text.

    Args:
        accuracy: Accuracy study; without a measured error the result is empty.
    """
    references = Counter(m.errors[accuracy.judged].against for m in compared(accuracy))
    return references.most_common(1)[0][0] if references else ""


def _remark(measurement: Measurement, accuracy: Accuracy, usual: str) -> str:
    """Return the reference of a run if it is unusual, or the reason of its failure."""
    if measurement.failed:
        words = " ".join(measurement.failed.split())
        return f"failed: {words if len(words) <= LONGEST_MESSAGE else words[:LONGEST_MESSAGE] + ' …'}"
    error = measurement.errors.get(accuracy.judged)
    if error is None:
        return "reference run"
    return "" if error.against == usual else f"compared with {error.against.removeprefix('run ')}"


def legend(accuracy: Accuracy) -> str:
    """Return the explanation of marks, usual reference and error names below the table of runs, as one text."""
    names = [f"{short(name)}: {words}" for name, words in accuracy.errors.items() if short(name) != words]
    usual = usual_reference(accuracy)
    reference = [f"compared with {usual} unless stated otherwise"] if usual else []
    return "; ".join([f"{ON_FRONT} on the Pareto front", *reference, *names])


def orders(accuracy: Accuracy) -> dict:
    """Return the table of observed and theoretical orders, and of the growth of the cost.

    Args:
        accuracy: Convergence study with its fits.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text), one row per parameter and quantity.
    """
    rows = [
        [
            parameter,
            short(quantity),
            f"{error.order:.2f}",
            "" if error.theory is None else f"{error.theory:g}",
            _growth(fit),
        ]
        for parameter, fit in accuracy.fits.items()
        for quantity, error in fit.errors.items()
    ]
    return {"head": ["parameter", "error", "order", "theory", "core-seconds"], "rows": rows, "prose": True}


def _growth(fit: Fit) -> str:
    """Write the fit of the cost over the value h of the parameter."""
    if fit.cost is None:
        return ""
    cost = fit.cost
    return f"{cost.start:.3g} + {number(cost.constant)} h^-{cost.exponent:.2f}, within {100.0 * cost.scatter:.3g} %"


def prediction(accuracy: Accuracy) -> dict | None:
    """Return the table of predicted and measured error and cost of the recommendation; None if it was not run.

    Args:
        accuracy: Convergence study.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): rows error and core-seconds; None if the
        recommendation was not run.
    """
    chosen = accuracy.recommended
    if chosen is None or chosen.found is None or accuracy.judged not in chosen.found.errors:
        return None
    error, seconds = chosen.found.errors[accuracy.judged].value, chosen.found.core_seconds
    rows = [
        [
            f"error: {short(accuracy.judged)}",
            percent(chosen.error),
            percent(error),
            change(error, chosen.error),
        ],
        ["core-seconds", f"{chosen.core_seconds:.2f} s", f"{seconds:.2f} s", change(seconds, chosen.core_seconds)],
    ]
    return {"head": ["", "predicted", "measured", "difference"], "rows": rows}


def change(measured: float, predicted: float) -> str:
    """Write the relative difference of a measured from a predicted value in per cent with its sign, such as "+12 %"."""
    return f"{100.0 * (measured / predicted - 1.0):+.0f} %"


def as_lines(settings: Mapping[str, str]) -> list[str]:
    """Return settings as lines of a case file, grouped by table.

    Args:
        settings: Dotted key -> value as text, as for ``--set``.
    """
    lines: list[str] = []
    table = None
    for key, text in sorted(settings.items()):
        head, _, name = key.rpartition(".")
        if head != table:
            table = head
            lines.append(f"[{head}]")
        lines.append(f"{name} = {as_toml(override_value(text))}")
    return lines


def as_options(settings: Mapping[str, str]) -> str:
    """Return settings as options ``--set key=value`` of the command line, quoted for a shell.

    Args:
        settings: Dotted key -> value as text.
    """
    return " ".join(f"--set {shlex.quote(f'{key}={text}')}" for key, text in settings.items())
