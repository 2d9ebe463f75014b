"""What the real shapes of the joints change: the shock beside one in which all joints are identical."""

from collections.abc import Mapping, Sequence

from numpy.typing import NDArray

from reflowshock.fem.output.ranking import PEEL
from reflowshock.workflow.board_drop.identical_joints import shape_effect
from reflowshock.workflow.case.text import mega, number, percent
from reflowshock.workflow.report.charts import Axis, Chart, Series
from reflowshock.workflow.report.colours import BLUE, ORANGE
from reflowshock.workflow.report.curves import MILLI, TIME
from reflowshock.workflow.report.histories import joint_stress, peel_peaks

Arrays = Mapping[str, NDArray]

MEGA = 1e6
SHOWN = 30  # joints of the chart, the critical one first


def in_words(real: Arrays, identical: Arrays) -> str:
    """Say what the real shapes change in the critical joint, and whether another one becomes critical."""
    found, flat = peel_peaks(real), peel_peaks(identical)
    critical, other = next(iter(found)), next(iter(flat))
    effect = shape_effect(found[critical], flat[critical])
    word = "raise" if found[critical] >= flat[critical] else "lower"
    by = "" if effect is None else f" by {percent(abs(effect))}"
    same = "it is the critical one in both" if critical == other else f"there {other} would be the critical one"
    real_text, flat_text = (f"{number(stress[critical] / MEGA)} MPa" for stress in (found, flat))
    return (
        f"The real shapes {word} the peak peel stress of {critical}{by}: {real_text} instead of"
        f" {flat_text} under a flat package on identical truncated spheres; {same}."
    )


def table(real: Arrays, identical: Arrays, joints: Sequence[Mapping]) -> dict:
    """Peak peel stress of every joint with its real shape and as one of identical joints, the critical one first."""
    found, flat = peel_peaks(real), peel_peaks(identical)
    standoff = {joint["name"]: joint["standoff"] for joint in joints}
    rows = []
    for name in found:
        effect = shape_effect(found[name], flat[name])
        told = "–" if effect is None else f"{100.0 * effect:+.2f} %"
        rows.append([name, mega(found[name]), mega(flat[name]), told, f"{1e6 * standoff[name]:.1f}"])
    return {
        "head": ["joint", "real, peel [MPa]", "identical, peel [MPa]", "change", "real standoff [µm]"],
        "rows": rows,
    }


def curves(real: Arrays, identical: Arrays) -> list[Chart]:
    """Return the critical joint's peel stress with real and identical joints, and the peaks of all joints."""
    found, flat = peel_peaks(real), peel_peaks(identical)
    critical, names = next(iter(found)), list(found)[:SHOWN]
    kinds = ((real, found, "real shapes", BLUE), (identical, flat, "identical joints", ORANGE))
    lines = [
        Series(label, history["time"] / MILLI, joint_stress(history, critical, PEEL) / MEGA, colour)
        for history, _, label, colour in kinds
    ]
    peaks = [
        Series(label, range(len(names)), [of[name] / MEGA for name in names], colour, line="none", marks=True)
        for _, of, label, colour in kinds
    ]
    return [
        Chart(TIME, Axis(f"peel stress of {critical} [MPa]"), lines),
        Chart(Axis("joint, the critical one first", names=names), Axis("peak peel stress [MPa]"), peaks),
    ]
