"""What the real shapes of the joints change: the shock beside one in which all joints are identical."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import pyplot
from numpy.typing import NDArray

from reflowshock.workflow.case.text import mega, number, percent
from reflowshock.workflow.report.curves import MILLI, STYLE, svg
from reflowshock.workflow.report.histories import joint_stress, peaks

Arrays = Mapping[str, NDArray]

MEGA = 1e6
REAL, IDENTICAL = "#0b5fa5", "#9aa5b1"
SHOWN = 30  # joints of the bar chart, the most stressed ones


def change(real: float, identical: float) -> float:
    """Return by what fraction real shapes change a stress."""
    return real / identical - 1.0


def in_words(real: Arrays, identical: Arrays) -> str:
    """Say what the real shapes change in the critical joint, and whether another one becomes critical."""
    found, flat = peaks(real), peaks(identical)
    critical, other = max(found, key=found.__getitem__), max(flat, key=flat.__getitem__)
    effect = change(found[critical], flat[critical])
    word = "raise" if effect >= 0.0 else "lower"
    same = "it is the critical one in both" if critical == other else f"there {other} would be the critical one"
    real_text, flat_text = (f"{number(stress[critical] / MEGA)} MPa" for stress in (found, flat))
    return (
        f"The real shapes {word} the peak stress of {critical} by {percent(abs(effect))}: {real_text} instead of"
        f" {flat_text} under a flat package on identical truncated spheres; {same}."
    )


def table(real: Arrays, identical: Arrays, joints: Sequence[Mapping]) -> dict:
    """Peak stress of every joint with its real shape and as one of identical joints, most stressed first."""
    found, flat = peaks(real), peaks(identical)
    standoff = {joint["name"]: joint["standoff"] for joint in joints}
    rows = [
        [name, mega(found[name]), mega(flat[name]), f"{100.0 * change(found[name], flat[name]):+.2f} %",
         f"{1e6 * standoff[name]:.1f}"]
        for name in sorted(found, key=lambda name: -found[name])
        if name in flat
    ]  # fmt: skip
    return {"head": ["joint", "real [MPa]", "identical [MPa]", "change", "real standoff [µm]"], "rows": rows}


def curves(real: Arrays, identical: Arrays) -> str:
    """Draw the critical joint's stress with real and identical joints, and the peaks of all joints."""
    found, flat = peaks(real), peaks(identical)
    critical = max(found, key=found.__getitem__)
    with pyplot.rc_context(STYLE):
        figure, (left, right) = pyplot.subplots(1, 2, figsize=(9.2, 3.4), constrained_layout=True)
        for history, label, colour in ((identical, "identical joints", IDENTICAL), (real, "real shapes", REAL)):
            left.plot(history["time"] / MILLI, joint_stress(history, critical) / MEGA, color=colour, label=label)
        left.set(xlabel="time [ms]", ylabel=f"von Mises at the pads of {critical} [MPa]")
        left.legend(frameon=False)
        names = [name for name in sorted(found, key=lambda name: -found[name]) if name in flat][:SHOWN]
        place = np.arange(len(names))
        right.bar(place - 0.2, [flat[name] / MEGA for name in names], 0.4, color=IDENTICAL, label="identical joints")
        right.bar(place + 0.2, [found[name] / MEGA for name in names], 0.4, color=REAL, label="real shapes")
        right.set_xticks(place, names, rotation=90, fontsize=7)
        right.set(ylabel="peak von Mises at the pads [MPa]")
        right.grid(axis="x", visible=False)
        return svg(figure)
