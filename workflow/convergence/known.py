"""What a convergence study of a case says of the discretisation errors of its runs."""

from pathlib import Path

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.convergence.calibration import folder_name
from reflowshock.workflow.convergence.errors import Error
from reflowshock.workflow.convergence.measured import FILE, Accuracy, Measurement, read_accuracy
from reflowshock.workflow.report.errors import Discretisation
from reflowshock.workflow.store.keys import product_keys
from reflowshock.workflow.store.store import HOME

OWN_SIZE = 1.0  # of elements, over those of the case
SAFETY, SAFETY_WITHOUT_ORDER = 1.25, 3.0  # Roache, J. Fluids Eng. 116 (1994) 405: three meshes and more, two
STALE = "the case has changed since reflowshock accuracy was run; run it again"
COARSEST = "reflowshock accuracy has not compared the mesh of the case with finer ones"


def own_accuracy(run_folder: Path, case: Case) -> Accuracy | None:
    """Return what was measured of a case, beside its run folder; None where nothing was.

    Args:
        run_folder: of a run, or the one in a store in which a product of the run is being made.
        case: of the run.
    """
    place = run_folder.resolve()
    store = next((folder for folder in place.parents if folder.name == HOME), None)
    beside = (store.parent if store else place).parent
    found = read_accuracy(beside / folder_name(case) / FILE)
    return found if found is not None and found.kind == case.kind else None


def is_of(accuracy: Accuracy, case: Case) -> bool:
    """Whether a measurement was made with all the inputs that a case has now, and this version of the program."""
    return accuracy.key in product_keys(case).values()


def discretisation(run_folder: Path, case: Case) -> Discretisation:
    """Return the discretisation errors of the figures of a run: grid convergence indices of the case's own mesh."""
    found = own_accuracy(run_folder, case)
    if found is None:
        return Discretisation()
    if not is_of(found, case):
        return Discretisation(unknown=STALE)
    run = _own_mesh(found)
    errors = {} if run is None else dict(run.errors)
    return Discretisation(
        {name: grid_convergence_index(error) for name, error in errors.items()},
        {name: error.against for name, error in errors.items()},
        "reflowshock accuracy does not measure it" if errors else COARSEST,
    )


def grid_convergence_index(error: Error) -> float:
    """Return the error that is told of a mesh: the found one times a safety factor.

    That is 1.25 where three meshes show an order and the error is from their limit, else 3, as for two meshes.
    """
    return error.value * (SAFETY_WITHOUT_ORDER if error.order is None else SAFETY)


def _own_mesh(accuracy: Accuracy) -> Measurement | None:
    """Return the run on the mesh of the case whose errors are those of the whole answer; None where none was run."""
    runs = (one for one in accuracy.measurements if one.value == OWN_SIZE and not one.against and one.errors)
    return next(runs, None)
