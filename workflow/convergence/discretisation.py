"""Discretisation errors of a run, from its companions on coarser meshes or from the convergence study of its case.

The reported error is the grid convergence index of Roache, J. Fluids Eng. 116 (1994) 405.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.stage import ERRORS
from reflowshock.workflow.convergence.accuracy_file import FILE, Accuracy, Measurement, read_accuracy
from reflowshock.workflow.convergence.calibration import folder_name
from reflowshock.workflow.convergence.error_estimate import FILE as ESTIMATED
from reflowshock.workflow.convergence.errors import Error
from reflowshock.workflow.convergence.grid_convergence import SAFETY, SAFETY_WITHOUT_ORDER
from reflowshock.workflow.process.products import read_json
from reflowshock.workflow.report.errors import Discretisation
from reflowshock.workflow.store.keys import product_keys
from reflowshock.workflow.store.product import read_record
from reflowshock.workflow.store.store import HOME
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.references import ERRORS_OF_EXACT

CASE_SIZE = 1.0  # element size relative to the case
OFF = "numerics.error.method is off"
NOT_RUN = "stage errors has not run"
HEATED = "with [thermal] each coarser mesh would repeat the reflow; reflowshock accuracy measures it"
STALE = "the case has changed since reflowshock accuracy was run; run it again"
EXACT = "exact solution"
NOT_COMPARED = "the exact solution does not give it"
COARSEST = "reflowshock accuracy has not compared the mesh of the case with finer ones"


def read_case_accuracy(run_folder: Path, case: Case) -> Accuracy | None:
    """Read the convergence study of a case from the folder next to its run folder; return None without one.

    Args:
        run_folder: Run folder, or the work folder in a store while a product is computed.
        case: Case of the run.
    """
    folder = run_folder.resolve()
    store = next((parent for parent in folder.parents if parent.name == HOME), None)
    runs = (store.parent if store else folder).parent
    accuracy = read_accuracy(runs / folder_name(case) / FILE)
    return accuracy if accuracy is not None and accuracy.kind == case.kind else None


def is_current(accuracy: Accuracy, case: Case) -> bool:
    """Return whether a study was run with the present inputs of a case and this version of the program.

    Args:
        accuracy: Study, whose key identifies the inputs.
        case: Case as it is now.
    """
    return accuracy.key in product_keys(case).values()


def discretisation(run_folder: Path, case: Case) -> Discretisation:
    """Return the discretisation errors of a run: grid convergence indices of the mesh of its case.

    Args:
        run_folder: Run folder; a study is searched next to it.
        case: Case of the run.

    Returns:
        Relative error of each metric by name, its origin in words, and why others are unknown; empty without a study.
    """
    if case.error_method == "off":
        return Discretisation(unknown=OFF)
    if ERRORS in case.pipeline.stages:
        return _estimated(run_folder / ERRORS.name / ESTIMATED)
    if case.error_method == "estimate" and isinstance(case, StructureCase):
        return _exact(run_folder)
    return _measured(run_folder, case)


def _estimated(path: Path) -> Discretisation:
    """Read the errors that the stage errors has estimated."""
    if not path.is_file():
        return Discretisation(unknown=NOT_RUN)
    figures = read_json(path)
    return Discretisation(
        _known(figures, "discretisation"),
        {name: error["how"] for name, error in figures.items()},
        "companions do not estimate it",
        _known(figures, "order"),
        _known(figures, "two_scale"),
        next((error["two_scale_how"] for error in figures.values() if error["two_scale_how"]), ""),
    )


def _known(figures: Mapping[str, Mapping[str, Any]], key: str) -> dict[str, float]:
    """Return a value of each figure that has one, by name."""
    return {name: error[key] for name, error in figures.items() if error[key] is not None}


def _exact(run_folder: Path) -> Discretisation:
    """Return the errors of a structure against its exact solution, as the stage comparison has found them."""
    metrics = (read_record(run_folder / "comparison") or {"metrics": {}})["metrics"]
    errors = {name: abs(float(metrics[name]["value"])) for name in ERRORS_OF_EXACT if name in metrics}
    return Discretisation(errors, dict.fromkeys(errors, EXACT), NOT_COMPARED)


def _measured(run_folder: Path, case: Case) -> Discretisation:
    """Return the errors from the convergence study of a case."""
    accuracy = read_case_accuracy(run_folder, case)
    if accuracy is None:
        return Discretisation(unknown=HEATED) if case.error_method == "estimate" else Discretisation()
    if not is_current(accuracy, case):
        return Discretisation(unknown=STALE)
    run = _run_of_case(accuracy)
    errors = {} if run is None else dict(run.errors)
    return Discretisation(
        {name: grid_convergence_index(error) for name, error in errors.items()},
        {name: error.against for name, error in errors.items()},
        "reflowshock accuracy does not measure it" if errors else COARSEST,
        {name: error.order for name, error in errors.items() if error.order is not None},
    )


def grid_convergence_index(error: Error) -> float:
    """Return a relative error times a safety factor: 1.25 if it is against a Richardson extrapolation, else 3."""
    return error.value * (SAFETY_WITHOUT_ORDER if error.order is None else SAFETY)


def _run_of_case(accuracy: Accuracy) -> Measurement | None:
    """Return the run on the mesh of the case whose errors are total errors; None without one."""
    runs = (run for run in accuracy.measurements if run.value == CASE_SIZE and not run.against and run.errors)
    return next(runs, None)
