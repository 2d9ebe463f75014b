"""What the real shapes of the joints change: the shock beside one in which all joints are identical."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import pyplot
from numpy.typing import NDArray

from reflowshock.fem.output.ranking import PEEL
from reflowshock.workflow.board_drop.identical_joints import shape_effect
from reflowshock.workflow.case.text import mega, number, percent
from reflowshock.workflow.report.curves import MILLI, STYLE, svg
from reflowshock.workflow.report.histories import joint_stress, peel_peaks

Arrays = Mapping[str, NDArray]

MEGA = 1e6
REAL, IDENTICAL = "#0b5fa5", "#9aa5b1"
SHOWN = 30  # joints of the bar chart, the critical one first


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


def curves(real: Arrays, identical: Arrays) -> str:
    """Draw the critical joint's peel stress with real and identical joints, and the peaks of all joints."""
    found, flat = peel_peaks(real), peel_peaks(identical)
    critical = next(iter(found))
    with pyplot.rc_context(STYLE):
        figure, (left, right) = pyplot.subplots(1, 2, figsize=(9.2, 3.4), constrained_layout=True)
        for history, label, colour in ((identical, "identical joints", IDENTICAL), (real, "real shapes", REAL)):
            stress = joint_stress(history, critical, PEEL) / MEGA
            left.plot(history["time"] / MILLI, stress, color=colour, label=label)
        left.set(xlabel="time [ms]", ylabel=f"peel stress of {critical} [MPa]")
        left.legend(frameon=False)
        names = list(found)[:SHOWN]
        place = np.arange(len(names))
        right.bar(place - 0.2, [flat[name] / MEGA for name in names], 0.4, color=IDENTICAL, label="identical joints")
        right.bar(place + 0.2, [found[name] / MEGA for name in names], 0.4, color=REAL, label="real shapes")
        right.set_xticks(place, names, rotation=90, fontsize=7)
        right.set(ylabel="peak peel stress [MPa]")
        right.grid(axis="x", visible=False)
        return svg(figure)
