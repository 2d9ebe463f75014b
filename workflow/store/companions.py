"""Companions of a run in its store: the same case on coarser meshes, run to estimate errors.

They are linked in the work folder of the stage errors.
"""

import os
from collections.abc import Mapping
from pathlib import Path

from reflowshock.workflow.case.stage import ERRORS
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import discard
from reflowshock.workflow.store.store import Store

FOLDER = "companions"  # in a run folder and in the work folder of the stage
FAILED = "failed.txt"  # message of a companion without a result
UNTIL = ERRORS.follows[-1]  # last stage of a companion
SIZES = (1.5, 2.0)  # element sizes of companions relative to the case
HALF_WINDOW = "half_window"  # companion with the largest elements and half the coupling window
CHEAP = 0.3  # largest cost of one model on the coarsest mesh, over that of the shock of the run

Companions = Mapping[str, Point]


def size_name(size: float) -> str:
    """Return the name of a companion (the same case on a coarser mesh), such as ``size_1.5``.

    Args:
        size: Element size relative to the case.
    """
    return f"size_{size:g}"


COARSEST = size_name(SIZES[-1])


def companion_title(name: str) -> str:
    """Return the difference of a companion from its case in words, such as "elements x 1.5".

    Args:
        name: Name of the companion, from ``size_name``, or ``half_window``.
    """
    if name == HALF_WINDOW:
        return f"elements x {SIZES[-1]:g}, half the window"
    return f"elements x {name.removeprefix(size_name(0.0)[:-1])}"


def companion_folder(run_folder: Path, name: str) -> Path:
    """Return the folder with the products of a companion (the same case on a coarser mesh), which may not exist.

    Args:
        run_folder: Run folder, or work folder of the stage errors.
        name: Name of the companion, such as ``size_2``.
    """
    return run_folder / FOLDER / name


def link_companions(store: Store, work: Path, companions: Companions) -> None:
    """Link the shocks of companions into the work folder of the stage errors.

    For a companion without a result, the file ``failed.txt`` in its folder has the message of the stage that failed.

    Args:
        store: Store of the products, read only.
        work: Work folder of the stage; the folders of companions are created in it, and earlier links replaced.
        companions: Point (case with settings) of each companion by name; each is the same case on a coarser mesh.
    """
    for name, point in companions.items():
        folder = companion_folder(work, name)
        folder.mkdir(parents=True, exist_ok=True)
        discard(folder / UNTIL)
        if store.has(point, UNTIL):
            (folder / UNTIL).symlink_to(os.path.relpath(store.product(point, UNTIL), folder))
            (folder / FAILED).unlink(missing_ok=True)
        else:
            (folder / FAILED).write_text(_message(store, point), encoding="utf-8")


def _message(store: Store, point: Point) -> str:
    """Return the first line of the message of the stage at which a companion ended."""
    stages = [stage.name for stage in point.case.pipeline.upstream(UNTIL) if not store.has(point, stage.name)]
    text = next((message for stage in stages if (message := store.message(point, stage))), "ended without a message")
    return f"stage {stages[0]} failed: {text.strip().splitlines()[0]}"
