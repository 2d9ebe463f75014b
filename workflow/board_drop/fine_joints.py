"""Fine joints of a shock: all, named ones, or the most stressed ones of a coarse run."""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from reflowshock.effect import Decision, Effect, Toggle, decision
from reflowshock.names import find_nearest
from reflowshock.problem import Problem

if TYPE_CHECKING:
    from reflowshock.fem.problem.shock import JointCoupling
    from reflowshock.meshing.board.pads import PadSite
    from reflowshock.workflow.board_drop.board_deflection import DropScene
    from reflowshock.workflow.package.case import BoardDropCase

FINE, CRITICAL = "shock.coupling.fine_joints", "shock.coupling.critical_joints"


@dataclass(frozen=True, slots=True)
class FineJoints:
    """Fine joints of a two-scale run.

    Attributes:
        names: Their names, or "all".
        why: Reason for the choice.
        end: End of the shock [s], if the run that found them decides it; else None.
        end_why: Reason for the end.
    """

    names: tuple[str, ...] | str
    why: str
    end: float | None = None
    end_why: str = ""


def needs_coarse_joints(coupling: "JointCoupling | None") -> bool:
    """Return whether a shock needs coarse joint meshes: for joints that are not fine, or for a one-way macro model.

    Args:
        coupling: Coupling of the macro model (board) and the meso model (joints); None, without a two-scale run, needs
            no coarse joints.
    """
    return coupling is not None and (coupling.fine_joints != "all" or coupling.direction == "one_way")


class CoarseJoints(Effect["DropScene"]):
    """Effect: joints with a coarse mesh."""

    name = "coarse_joints"
    adds = "eight hexahedra per joint instead of the fine mesh"
    influence = "0.1 % of the fine joints' stress (cases/bga_drop, measured)"
    implementation = "reflowshock.workflow.board_drop.fine_joints.FineJoints"
    switch = "shock.coupling.fine_joints = all, critical, names"
    source = "cases/bga_drop/README.md"
    toggle = Toggle(FINE, "critical", "all")

    def decide(self, drop: "DropScene") -> Decision:
        """Return the setting of the case."""
        coupling = drop.shock.coupling
        if coupling.direction == "one_way":
            why = "shock.coupling.direction = one_way: the macro model has all joints coarse"
        elif coupling.fine_joints == "all":
            why = "all joints are fine"
        else:
            why = f"{FINE} = {_in_words(coupling.fine_joints)}: all others are coarse"
        return decision(needs_coarse_joints(coupling), why)


def named_joints(coupling: "JointCoupling") -> FineJoints:
    """Return the fine joints that a case names, with the setting as reason.

    Args:
        coupling: Coupling whose ``fine_joints`` is "all" or a tuple of joint names.

    Returns:
        The same names, and the setting as text.
    """
    return FineJoints(coupling.fine_joints, f"{FINE} = {_in_words(coupling.fine_joints)}")


def most_stressed(history: Path, count: int) -> FineJoints:
    """Return the critical joints of a history, ranked by peel stress, or by plastic work if the solder yields.

    Args:
        history: File ``history.npz`` of a run with all joints coarse.
        count: Number of joints to return.

    Returns:
        Names of the joints, the most stressed first, and a text with their peaks as reason.
    """
    import numpy as np

    from reflowshock.fem.output.ranking import rank_joints, ranking_measure
    from reflowshock.workflow.case.text import quantity

    with np.load(history) as arrays:
        names, order, measure = arrays["joints"], rank_joints(arrays), ranking_measure(arrays)
        peak = measure.peaks(arrays)
    peaks = [f"{names[k]} {quantity({'value': float(peak[k]), 'unit': measure.unit})}" for k in order[: count + 1]]
    why = f"the most stressed of {len(names)} by {measure.name} in a run with coarse joints: {', '.join(peaks[:count])}"
    if len(peaks) > count:
        why += f"; the next is {peaks[count]}"
    return FineJoints(tuple(str(names[k]) for k in order[:count]), why)


def with_end(fine: FineJoints, history: Path) -> FineJoints:
    """Return the fine joints with the end of a damped shock, half a swing after the largest stress of a coarse run."""
    import numpy as np

    from reflowshock.fem.output.settled import DECAYED, WATCHED, latest_swings, needed_end
    from reflowshock.workflow.case.text import short

    with np.load(history) as file:
        arrays = {name: file[name] for name in WATCHED if name in file}
    end, computed, rest = needed_end(arrays), float(arrays["time"][-1]), latest_swings(arrays)
    if end is None or end > computed:
        return replace(fine, end=computed, end_why=f"longest duration, {short(computed)}; the board still swings")
    why = (
        f"half a swing after the largest stress in a run with coarse joints to {short(computed)}, whose two latest"
        f" swings reached {rest:.2g} of it"
    )
    later = "damping excludes larger ones later" if rest <= DECAYED else "larger ones later are not excluded"
    return replace(fine, end=end, end_why=f"{why}; {later}")


def write_fine_joints(folder: Path, fine: FineJoints) -> None:
    """Write ``fine_joints.json`` into the folder of a shock.

    Args:
        folder: Folder of the shock, which must exist.
        fine: Names of the fine joints, or "all", the reason, and the end of the shock if it was found.
    """
    (folder / "fine_joints.json").write_text(json.dumps(asdict(fine), indent=1) + "\n", encoding="utf-8")


def read_fine_joints(folder: Path) -> FineJoints | None:
    """Read ``fine_joints.json`` of a shock; None if it does not exist.

    Returns:
        Names of the joints with a fine mesh, or "all", and the reason for the choice.
    """
    path = folder / "fine_joints.json"
    if not path.exists():
        return None
    table = json.loads(path.read_text(encoding="utf-8"))
    names = table["names"]
    return FineJoints(**(table | {"names": names if isinstance(names, str) else tuple(names)}))


def problems(case: "BoardDropCase") -> Iterator[Problem]:
    """Yield problems of unknown joints, and of more critical joints than the model has.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    from reflowshock.meshing.board.pads import pad_table

    coupling, sites = case.shock.coupling, pad_table(case.package, case.board, case.warpage)
    chosen = coupling.fine_joints
    if chosen == "critical" and coupling.critical_joints > len(sites):
        message = "is more than the number of joints in the model"
        yield Problem(CRITICAL, message, coupling.critical_joints, f"1 to {len(sites)}")
    if isinstance(chosen, str):
        return
    if not chosen:
        yield Problem(FINE, "leaves the meso model empty", [], "all, critical, or at least one name")
    for name in chosen:
        yield from _unknown(name, sites, case)


def _unknown(name: str, sites: "list[PadSite]", case: "BoardDropCase") -> Iterator[Problem]:
    """Yield the problem of an unknown joint name, with the nearest valid name."""
    names = [site.name for site in sites]
    if name in names:
        return
    image = "" if name.upper() in names else _image(name.upper(), sites, case)
    message = "lies in a quarter that is not modelled" if image else "is not a joint of the model"
    yield Problem(FINE, message, name, f"{names[0]} to {names[-1]}", image or find_nearest(name, names, similarity=0.5))


def _image(name: str, sites: "list[PadSite]", case: "BoardDropCase") -> str:
    """Return the joint of a quarter model whose mirror image has the name; empty if none does."""
    from reflowshock.meshing.board.pads import joint_name

    package = case.package
    for site in sites if case.board.symmetry == "quarter" else ():
        rows, columns = (site.row, package.rows - 1 - site.row), (site.column, package.columns - 1 - site.column)
        if name in {joint_name(row, column) for row in rows for column in columns}:
            return site.name
    return ""


def _in_words(chosen: tuple[str, ...] | str) -> str:
    return chosen if isinstance(chosen, str) else ", ".join(chosen)
