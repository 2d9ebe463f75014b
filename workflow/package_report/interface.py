"""Von Mises stress of all joints at the package pads, two-scale and DNS, at the picture times."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reflowshock.workflow.case.text import mega, percent
from reflowshock.workflow.report.curves import MILLI
from reflowshock.workflow.report.scene import Field, Group, Scene
from reflowshock.workflow.report.tables import mode_name

Arrays = Mapping[str, NDArray]

MEGA = 1e6
STRESS = "von Mises stress"
MODE_SPACING = 1.15  # in widths of the array
FROM_ABOVE = (0.0, -0.01, 1.0)
SAME_TIME = 1e-6  # [s] modes write a picture at the end of their nearest window


def read_interfaces(shock: Path, modes: Sequence[str]) -> dict[str, dict[str, NDArray]]:
    """Read ``interface.npz`` of the modes that wrote one.

    Args:
        shock: Folder of the shock, with a folder for each mode.
        modes: Names of the modes, in the order of the result.

    Returns:
        Mode -> arrays of ``interface.npz``: ``times`` (k,) [s] and, per joint, ``points@``, ``quads@``, ``von_mises@``
        (k, q) [Pa]; empty if no mode wrote one.
    """
    interfaces = {}
    for mode in modes:
        path = shock / mode / "interface.npz"
        if path.exists():
            with np.load(path) as arrays:
                interfaces[mode] = dict(arrays)
    return interfaces


def joints_of(interface: Arrays) -> list[str]:
    """Return the joint names of an interface, in its order.

    Args:
        interface: Arrays of ``interface.npz``: ``times`` (k,) [s] and, per joint, ``points@``, ``quads@``,
            ``von_mises@`` (k, q) [Pa].
    """
    return [name.split("@")[1] for name in interface if name.startswith("von_mises@")]


def areas(interface: Arrays, joint: str) -> NDArray[np.float64]:
    """Return the areas of the faces of a joint, from their diagonals, shape (q,) [m^2].

    Args:
        interface: Arrays of ``interface.npz``: ``times`` (k,) [s] and, per joint, ``points@``, ``quads@``,
            ``von_mises@`` (k, q) [Pa]. ``points@`` has shape (n, 3) [m], ``quads@`` shape (q, 4).
        joint: Name of the joint.
    """
    corners = interface[f"points@{joint}"][interface[f"quads@{joint}"]]
    diagonals = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    return 0.5 * np.linalg.norm(np.cross(*diagonals), axis=1)


def times_of(interfaces: Mapping[str, Arrays]) -> NDArray[np.float64]:
    """Return the picture times of the mode with the most pictures, shape (k,) [s]; a mode that ended early has fewer.

    Args:
        interfaces: Mode -> arrays of ``interface.npz``: ``times`` (k,) [s] and, per joint, ``points@``, ``quads@``,
            ``von_mises@`` (k, q) [Pa].
    """
    return max((interface["times"] for interface in interfaces.values()), key=len)


def row_at(interface: Arrays, time: float) -> int | None:
    """Return the index of the picture within 1 µs of ``time`` [s]; None if the mode has none, since it ended before.

    Args:
        interface: Arrays of ``interface.npz``: ``times`` (k,) [s] and, per joint, ``points@``, ``quads@``,
            ``von_mises@`` (k, q) [Pa].
        time: Time [s].
    """
    distance = np.abs(interface["times"] - time)
    return int(distance.argmin()) if distance.min(initial=np.inf) <= SAME_TIME else None


def difference(ours: Arrays, reference: Arrays, joints: Sequence[str], time: float) -> float | None:
    """Return the relative L2 difference of two von Mises stress fields at a time, weighted by area.

    Args:
        ours: Arrays of ``interface.npz``: ``times`` (k,) [s] and, per joint, ``points@``, ``quads@``, ``von_mises@``
            (k, q) [Pa].
        reference: Arrays of the other mode, whose stress norm is the divisor unless it is zero.
        joints: Names of the joints to compare, with the same faces in both modes, see ``comparable``.
        time: Time of the picture [s].

    Returns:
        Relative difference; None unless both modes have a picture at that time.
    """
    row, row_of_reference = row_at(ours, time), row_at(reference, time)
    if row is None or row_of_reference is None:
        return None
    squares = np.zeros(2)
    for joint in joints:
        exact = reference[f"von_mises@{joint}"][row_of_reference]
        weight = areas(reference, joint)
        squares += weight @ (ours[f"von_mises@{joint}"][row] - exact) ** 2, weight @ exact**2
    return float(np.sqrt(squares[0] / squares[1])) if squares[1] > 0.0 else float(np.sqrt(squares[0]))


def comparable(interfaces: Mapping[str, Arrays]) -> list[str]:
    """Return the joints with the same faces in both modes; empty if only one mode was run.

    Args:
        interfaces: Mode -> arrays of ``interface.npz``: ``times`` (k,) [s] and, per joint, ``points@``, ``quads@``,
            ``von_mises@`` (k, q) [Pa]; one or two modes.
    """
    if len(interfaces) < 2:
        return []
    first, second = interfaces.values()
    keys = {joint: f"von_mises@{joint}" for joint in joints_of(first)}
    return [name for name, key in keys.items() if key in second and first[key].shape[1] == second[key].shape[1]]


def table(interfaces: Mapping[str, Arrays]) -> dict:
    """Return the table of largest stress, its joint and mean stress of each mode at each time, and their difference.

    Args:
        interfaces: Mode -> arrays of ``interface.npz``: ``times`` (k,) [s] and, per joint, ``points@``, ``quads@``,
            ``von_mises@`` (k, q) [Pa]; one or two modes.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text), one row per picture time: time [ms]; largest
        stress, its joint and mean stress [MPa] of each mode; relative L2 difference of two modes on the joints with
        equal faces.
    """
    shared = comparable(interfaces)
    rows = []
    for time in times_of(interfaces):
        rows_now = [(interface, row_at(interface, time)) for interface in interfaces.values()]
        extremes = [3 * ("–",) if row is None else _extremes(interface, row) for interface, row in rows_now]
        cells = [cell for cells_of_mode in extremes for cell in cells_of_mode]
        if shared:
            first, second = interfaces.values()
            differs = difference(first, second, shared, time)
            cells.append("–" if differs is None else percent(differs))
        rows.append([f"{time / MILLI:.4g}", *cells])
    heads = [head for mode in interfaces for head in (f"{mode_name(mode)}: largest [MPa]", "joint", "mean [MPa]")]
    last = [f"relative L2 difference ({len(shared)} joints)"] if shared else []
    return {"head": ["time [ms]", *heads, *last], "rows": rows}


def interface_scene(interfaces: Mapping[str, Arrays]) -> Scene:
    """Return a top view of the pad faces of all joints, coloured by von Mises stress, the modes side by side.

    Args:
        interfaces: Mode -> arrays of ``interface.npz``: ``times`` (k,) [s] and, per joint, ``points@``, ``quads@``,
            ``von_mises@`` (k, q) [Pa]; not empty.

    Returns:
        Interactive 3D scene for the report page, one frame per picture time.
    """
    times, first = times_of(interfaces), next(iter(interfaces.values()))
    corners = np.concatenate([first[f"points@{joint}"] for joint in joints_of(first)])
    width, top_edge = float(np.ptp(corners[:, 0])), float(corners[:, 1].max())
    groups: list[Group] = []
    parts: list[str] = []
    labels = []
    for column, (mode, interface) in enumerate(interfaces.items()):
        shift = np.array([MODE_SPACING * width * column, 0.0, 0.0])
        groups.append(_group(interface, times, shift, len(parts)))
        parts += [f"{joint}, {mode_name(mode)}" for joint in joints_of(interface)]
        position = (float(corners[:, 0].mean() + shift[0]), top_edge + 0.06 * width, float(corners[:, 2].mean()))
        labels.append((mode_name(mode), position))
    top = max(float(np.nanmax(group.values[STRESS])) for group in groups)
    frames = [f"{time / MILLI:.4g} ms" for time in times]
    return Scene(groups, parts, [Field(STRESS, "MPa", 0.0, top)], frames, view=FROM_ABOVE, labels=labels)


def _group(interface: Arrays, times: NDArray[np.float64], shift: NDArray[np.float64], first_part: int) -> Group:
    """Return the faces of a mode with the stress [MPa] of each at all times; NaN after the end of the mode."""
    rows, joints = [row_at(interface, time) for time in times], joints_of(interface)
    corners = [interface[f"points@{joint}"][interface[f"quads@{joint}"]].reshape(-1, 3) + shift for joint in joints]
    values = []
    for joint, places in zip(joints, corners, strict=True):
        stress, count = interface[f"von_mises@{joint}"] / MEGA, len(places) // 4
        of_faces = [np.full(count, np.nan) if row is None else stress[row] for row in rows]
        values.append(np.repeat(of_faces, 4, axis=1))
    points = np.concatenate(corners)
    part = np.repeat(first_part + np.arange(len(joints)), [len(places) for places in corners])
    stresses = {STRESS: np.concatenate(values, axis=1)}
    return Group("solder", points, np.arange(len(points)).reshape(-1, 4), part, values=stresses)


def _extremes(interface: Arrays, row: int) -> tuple[str, str, str]:
    """Return the largest stress in a row, its joint, and the mean over all faces, as text."""
    joints = joints_of(interface)
    peaks = [float(interface[f"von_mises@{joint}"][row].max()) for joint in joints]
    worst = int(np.argmax(peaks))
    weights = [areas(interface, joint) for joint in joints]
    force = sum(
        float(weight @ interface[f"von_mises@{joint}"][row]) for joint, weight in zip(joints, weights, strict=True)
    )
    return mega(peaks[worst]), joints[worst], mega(force / sum(float(weight.sum()) for weight in weights))
