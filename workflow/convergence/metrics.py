"""Errors that a run computed itself, read from the record of a stage."""

from collections.abc import Mapping
from pathlib import Path

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.convergence.convergence_study import Quantity
from reflowshock.workflow.store.product import read_record


def read_metric_errors(
    exact: str, errors: Mapping[str, str], stage: str, _case: Case, run_folder: Path
) -> dict[str, Quantity]:
    """Read errors against an exact solution; where a run has none, the value itself, to be compared with finer runs.

    The value is the metric whose name lacks the ending ``_error``.

    Args:
        exact: Name of the exact solution, stored as the source of each error.
        errors: Name of a metric ending in ``_error`` -> its explanation; only the names are used.
        stage: Stage whose record has the metrics.
        run_folder: Folder of the run, from which the record is read.

    Returns:
        Quantity by name of the error, also where it is the value: ``Quantity.exact`` is 0 for an error and None for a
        value. Empty if the stage has no record.
    """
    record = read_record(run_folder / stage)
    metrics = {} if record is None else record["metrics"]
    quantities = {}
    for name in errors:
        value_name = name.removesuffix("_error")
        if name in metrics:
            quantities[name] = Quantity(metrics[name]["value"], 0.0, 1.0, exact)
        elif value_name in metrics:
            quantities[name] = Quantity(metrics[value_name]["value"])
    return quantities
