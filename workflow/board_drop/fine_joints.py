"""Which joints of a shock are fine: all, those that the case names, or the most stressed ones of a coarse run."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from reflowshock.effect import Decision, Effect, Toggle, decision
from reflowshock.names import nearest
from reflowshock.problem import Problem
from reflowshock.workflow.case.text import mega

if TYPE_CHECKING:
    from reflowshock.fem.problem.shock import JointCoupling
    from reflowshock.meshing.board.pads import PadSite
    from reflowshock.workflow.board_drop.board_deflection import DropScene
    from reflowshock.workflow.package.case import BoardDropCase

FINE, CRITICAL = "shock.coupling.fine_joints", "shock.coupling.critical_joints"


@dataclass(frozen=True, slots=True)
class FineJoints:
    """Names of the fine joints, or "all", and how they were chosen."""

    names: tuple[str, ...] | str
    why: str


def needs_coarse_joints(coupling: "JointCoupling | None") -> bool:
    """Whether some joint, or the macro model of a one-way run, needs the coarse mesh of joints."""
    return coupling is not None and (coupling.fine_joints != "all" or coupling.direction == "one_way")


class CoarseJoints(Effect["DropScene"]):
    """Joints that are also meshed coarse."""

    name = "coarse_joints"
    adds = "eight hexahedra a joint instead of the fine mesh"
    influence = "0.1 % of the fine joints' stress (cases/bga_drop, measured)"
    place = "reflowshock.workflow.board_drop.fine_joints.FineJoints"
    switch = "shock.coupling.fine_joints = all, critical, names"
    source = "cases/bga_drop/README.md"
    toggle = Toggle(FINE, "critical", "all")

    def decide(self, drop: "DropScene") -> Decision:
        """As the case says."""
        coupling = drop.shock.coupling
        if coupling.direction == "one_way":
            why = "shock.coupling.direction = one_way: the macro model has all joints coarse"
        elif coupling.fine_joints == "all":
            why = "all joints are fine"
        else:
            why = f"{FINE} = {_in_words(coupling.fine_joints)}: all others are coarse"
        return decision(needs_coarse_joints(coupling), why)


def named_joints(coupling: "JointCoupling") -> FineJoints:
    """Return the fine joints of a case that says which they are."""
    return FineJoints(coupling.fine_joints, f"{FINE} = {_in_words(coupling.fine_joints)}")


def most_stressed(history: Path, count: int) -> FineJoints:
    """Return the joints whose von Mises stress, averaged over the solder at either pad, peaks highest in a history."""
    import numpy as np

    with np.load(history) as arrays:
        names, ends = arrays["joints"], (arrays["von_mises_board"], arrays["von_mises_package"])
    peak = np.maximum(*ends).max(axis=0)
    order = np.argsort(-peak, kind="stable")
    ranked = [f"{names[k]} {mega(peak[k])} MPa" for k in order[: count + 1]]
    why = f"the most stressed of {len(names)} in a run with coarse joints: {', '.join(ranked[:count])}"
    if len(ranked) > count:
        why += f"; the next is {ranked[count]}"
    return FineJoints(tuple(str(names[k]) for k in order[:count]), why)


def write_fine_joints(folder: Path, fine: FineJoints) -> None:
    """Write ``fine_joints.json`` of a shock."""
    (folder / "fine_joints.json").write_text(
        json.dumps({"names": fine.names, "why": fine.why}, indent=1) + "\n", encoding="utf-8"
    )


def read_fine_joints(folder: Path) -> FineJoints | None:
    """Read what ``write_fine_joints`` wrote; None where the shock has none."""
    path = folder / "fine_joints.json"
    if not path.exists():
        return None
    table = json.loads(path.read_text(encoding="utf-8"))
    names = table["names"]
    return FineJoints(names if isinstance(names, str) else tuple(names), table["why"])


def problems(case: "BoardDropCase") -> Iterator[Problem]:
    """Find joints that the model does not have, and more critical ones than there are."""
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
    """Say of a name that the model does not have which one was meant."""
    names = [site.name for site in sites]
    if name in names:
        return
    image = "" if name.upper() in names else _image(name.upper(), sites, case)
    message = "lies in a quarter that is not modelled" if image else "is not a joint of the model"
    yield Problem(FINE, message, name, f"{names[0]} to {names[-1]}", image or nearest(name, names, alike=0.5))


def _image(name: str, sites: "list[PadSite]", case: "BoardDropCase") -> str:
    """Return the joint of a quarter model that is the mirror image of one outside it; empty where there is none."""
    from reflowshock.meshing.board.pads import joint_name

    package = case.package
    for site in sites if case.board.symmetry == "quarter" else ():
        rows, columns = (site.row, package.rows - 1 - site.row), (site.column, package.columns - 1 - site.column)
        if name in {joint_name(row, column) for row in rows for column in columns}:
            return site.name
    return ""


def _in_words(chosen: tuple[str, ...] | str) -> str:
    return chosen if isinstance(chosen, str) else ", ".join(chosen)
