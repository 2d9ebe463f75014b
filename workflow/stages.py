"""Stage functions of each kind of case.

Package on a board: geometry -> reflow -> surface -> solder_mesh -> shock -> errors -> report (`board_drop/stages.py`,
`reflow/stage.py`, `convergence/error_estimate.py`), the shock and its errors are optional. Structure: geometry -> shock
-> comparison -> report (`structure/stages.py`). Solder alone: reflow -> report (`solder/stages.py`). Flow: particles ->
report (`flows/stage.py`).

Each stage reads products of earlier stages from ``run.folder``, writes its own into ``folder``, and returns findings.
Packages are imported inside the functions, so that a stage loads only the packages that it needs.
"""

from pathlib import Path

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.run import Findings, Run, StageFunction
from reflowshock.workflow.kinds import kind_of


def stage_function(case: Case, name: str) -> StageFunction:
    """Return the function that makes the product of a stage: it takes a run and a folder and returns findings.

    Args:
        case: Case, whose kind decides on the function.
        name: Name of the stage.
    """
    return report if name == "report" else kind_of(case).stages[name]


def report(run: Run, folder: Path) -> Findings:
    """Write report.html and summary.json from the products.

    Args:
        run: Case, cores, and run folder from which the products of earlier stages are read.
        folder: Folder into which the products of the stage are written.

    Returns:
        Findings without metrics, health checks or effects, because a report adds none.
    """
    from reflowshock.workflow.pipeline.report import write_report

    write_report(run.folder, run.case, folder)
    return Findings()
