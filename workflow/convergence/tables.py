"""Tables of what accuracy costs, with the Pareto front: for the terminal, the page, a report and a README."""

import shlex
from collections import Counter
from collections.abc import Mapping, Sequence

from reflowshock.problem import as_toml
from reflowshock.workflow.case.scales import override_value
from reflowshock.workflow.case.text import number, percent
from reflowshock.workflow.convergence.measured import Accuracy, Fit, Measurement


def front(costs: Sequence[float], errors: Sequence[float]) -> list[int]:
    """Return which runs are on the front, the cheapest first.

    Args:
        costs: of each run.
        errors: of each run, equally many.
    """
    best, chosen = float("inf"), []
    for place in sorted(range(len(costs)), key=lambda k: (costs[k], errors[k])):
        if errors[place] < best:
            best = errors[place]
            chosen.append(place)
    return chosen


LONGEST_MESSAGE = 90
ON_FRONT = "*"
SMALLEST_ERROR = 5e-5  # that is told


def every_run(accuracy: Accuracy) -> list[Measurement]:
    """Return the runs that were run and, where it is none of them, the recommendation."""
    chosen = accuracy.recommended
    found = chosen.found if chosen else None
    extra = [] if found is None or found.run in {one.run for one in accuracy.measurements} else [found]
    return [*accuracy.measurements, *extra]


def compared(accuracy: Accuracy) -> list[Measurement]:
    """Return the runs whose judged error is known, and is that of the whole answer."""
    return [one for one in every_run(accuracy) if accuracy.judged in one.errors and not one.against]


def on_front(accuracy: Accuracy) -> set[str]:
    """Return the names of the runs that no other beats in both error and core-seconds."""
    known = compared(accuracy)
    chosen = front([one.core_seconds for one in known], [one.errors[accuracy.judged].value for one in known])
    return {known[place].run for place in chosen}


def runs(accuracy: Accuracy) -> dict:
    """Head and rows of text: runs, errors and costs, what they are compared with if not the usual, why they failed."""
    best, usual = on_front(accuracy), usually_against(accuracy)
    head = ["setting", *(short(name) for name in accuracy.errors), "wall s", "core s", ""]
    rows = []
    for one in sorted(every_run(accuracy), key=lambda one: (bool(one.failed), bool(one.against), one.core_seconds)):
        errors = [_error(one.errors[name].value) if name in one.errors else "" for name in accuracy.errors]
        cost = ["", ""] if one.failed else [number(float(f"{cost:.3g}")) for cost in (one.seconds, one.core_seconds)]
        name = f"{one.run} {ON_FRONT}" if one.run in best else one.run
        rows.append([name, *errors, *cost, _remark(one, accuracy, usual)])
    last = len(head) - 1
    shown = [column for column in range(len(head)) if column in {0, last} or any(row[column] for row in rows)]
    picked = [[row[column] for column in shown] for row in rows]
    return {"head": [head[column] for column in shown], "rows": picked, "prose": True}


def _error(share: float) -> str:
    """Write an error to a hundredth of a per cent."""
    return percent(share) if share >= 0.001 else f"{100.0 * share:.2f} %" if share >= SMALLEST_ERROR else "< 0.01 %"


def remarks(accuracy: Accuracy) -> list[str]:
    """Return what the last column of `runs` says, each remark once with the runs that it is about."""
    about: dict[str, list[str]] = {}
    for row in runs(accuracy)["rows"]:
        about.setdefault(row[-1], []).append(row[0].removesuffix(f" {ON_FRONT}"))
    return [f"{remark}: {', '.join(names)}" for remark, names in about.items() if remark]


def short(quantity: str) -> str:
    """Name of a quantity at the head of a column."""
    return quantity.removesuffix("_error").replace("_", " ")


def usually_against(accuracy: Accuracy) -> str:
    """Return what most runs are compared with that have the error of the whole answer."""
    against = Counter(one.errors[accuracy.judged].against for one in compared(accuracy))
    return against.most_common(1)[0][0] if against else ""


def _remark(one: Measurement, accuracy: Accuracy, usual: str) -> str:
    """Say what a run is compared with, if it is not the usual, or why it failed."""
    if one.failed:
        words = " ".join(one.failed.split())
        return f"failed: {words if len(words) <= LONGEST_MESSAGE else words[:LONGEST_MESSAGE] + ' …'}"
    error = one.errors.get(accuracy.judged)
    if error is None:
        return "not compared, nothing finer was run"
    return "" if error.against == usual else f"compared with {error.against.removeprefix('run ')}"


def legend(accuracy: Accuracy) -> str:
    """Say what marks and errors mean."""
    names = [f"{short(name)}: {words}" for name, words in accuracy.errors.items() if short(name) != words]
    usual = usually_against(accuracy)
    reference = [f"compared with {usual} unless stated otherwise"] if usual else []
    return "; ".join([f"{ON_FRONT} on the Pareto front", *reference, *names])


def orders(accuracy: Accuracy) -> dict:
    """Observed orders beside theory, and how cost grows."""
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
    """Write the fit of the cost; h is the value of the parameter."""
    if fit.cost is None:
        return ""
    cost = fit.cost
    return f"{cost.start:.3g} + {number(cost.constant)} h^-{cost.exponent:.2f}, within {100.0 * cost.scatter:.3g} %"


def prediction(accuracy: Accuracy) -> dict | None:
    """Error and cost of the recommendation: predicted and found; None where none was run."""
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
    return {"head": ["", "predicted", "found", "difference"], "rows": rows}


def change(found: float, predicted: float) -> str:
    """Write by how much what was found differs from what was predicted."""
    return f"{100.0 * (found / predicted - 1.0):+.0f} %"


def as_lines(settings: Mapping[str, str]) -> list[str]:
    """Write settings as lines of a case file, each table once."""
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
    """Write settings as options of the command line."""
    return " ".join(f"--set {shlex.quote(f'{key}={text}')}" for key, text in settings.items())
