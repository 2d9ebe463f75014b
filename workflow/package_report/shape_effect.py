"""Effect of the real joint shapes: comparison with a shock on identical joints."""

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
MOST_JOINTS = 30  # joints of the chart, the critical one first


def in_words(real: Arrays, identical: Arrays) -> str:
    """Return a sentence on how the real shapes change the peak peel stress of the critical joint.

    Args:
        real: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``joints`` (names), and k rows of each quantity, of
            the shock with real joints.
        identical: The same arrays of a shock with identical joints (truncated spheres of equal height).
    """
    peaks, identical_peaks = peel_peaks(real), peel_peaks(identical)
    critical, other = next(iter(peaks)), next(iter(identical_peaks))
    effect = shape_effect(peaks[critical], identical_peaks[critical])
    word = "raise" if peaks[critical] >= identical_peaks[critical] else "lower"
    by = "" if effect is None else f" by {percent(abs(effect))}"
    same = "it is critical in both" if critical == other else f"with these, {other} would be critical"
    real_text, flat_text = (f"{number(stress[critical] / MEGA)} MPa" for stress in (peaks, identical_peaks))
    return (
        f"The real shapes {word} the peak peel stress of {critical}{by}: {real_text} instead of"
        f" {flat_text} with identical truncated spheres under a flat package; {same}."
    )


def table(real: Arrays, identical: Arrays, joints: Sequence[Mapping]) -> dict:
    """Return the table of peak peel stress with real and with identical joints, the critical joint first.

    Args:
        real: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``joints`` (names), and k rows of each quantity, of
            the shock with real joints.
        identical: The same arrays of the shock with identical joints.
        joints: Records with ``name`` and ``standoff`` [m], see ``joint_records``.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text), one row per joint: name, both peaks [MPa],
        relative change, standoff of the real joint [µm].
    """
    peaks, identical_peaks = peel_peaks(real), peel_peaks(identical)
    standoff = {joint["name"]: joint["standoff"] for joint in joints}
    rows = []
    for name in peaks:
        effect = shape_effect(peaks[name], identical_peaks[name])
        change = "–" if effect is None else f"{100.0 * effect:+.2f} %"
        rows.append([name, mega(peaks[name]), mega(identical_peaks[name]), change, f"{1e6 * standoff[name]:.1f}"])
    return {
        "head": ["joint", "peel stress, real [MPa]", "peel stress, identical [MPa]", "change", "real standoff [µm]"],
        "rows": rows,
    }


def curves(real: Arrays, identical: Arrays) -> list[Chart]:
    """Return charts of the critical joint's peel stress and of the peaks of all joints, real and identical.

    Args:
        real: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``joints`` (names), and k rows of each quantity, of
            the shock with real joints.
        identical: The same arrays of the shock with identical joints.

    Returns:
        Interactive charts for the report page.
    """
    peaks, identical_peaks = peel_peaks(real), peel_peaks(identical)
    critical, names = next(iter(peaks)), list(peaks)[:MOST_JOINTS]
    kinds = ((real, peaks, "real shapes", BLUE), (identical, identical_peaks, "identical joints", ORANGE))
    lines = [
        Series(label, history["time"] / MILLI, joint_stress(history, critical, PEEL) / MEGA, colour)
        for history, _, label, colour in kinds
    ]
    points = [
        Series(label, range(len(names)), [of[name] / MEGA for name in names], colour, line="none", marks=True)
        for _, of, label, colour in kinds
    ]
    return [
        Chart(TIME, Axis(f"peel stress of {critical} [MPa]"), lines),
        Chart(Axis("joint, critical first", names=names), Axis("peak peel stress [MPa]"), points),
    ]
