"""Flat records of the joints, read from the products of all stages, and tables of such records."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from reflowshock.workflow.process.products import read_json

Record = Mapping[str, Any]
Column = tuple[str, str, Callable[[Any], str]]  # head, key of the record, text of its value


def joint_records(run_folder: Path) -> list[dict]:
    """Return one flat record for each joint: pad, reflow metrics, surface measures and mesh quality, in SI units.

    Angles are in degrees. A surface given by the user replaces the reflow metrics. Stages that have not run contribute
    nothing.

    Args:
        run_folder: Run folder, from which ``reflow``, ``surface`` and ``solder_mesh`` are read.

    Returns:
        Records in the order of the pad table, with ``name``, ``x``, ``y`` [m], ``shape`` (name of the joint with this
        shape), ``verdict``, and the measures that exist, such as ``standoff``, ``max_width``, ``volume``.
    """
    products = (
        read_json(run_folder / "reflow/joints.json"),
        _optional(run_folder / "surface/surfaces.json"),
        _optional(run_folder / "solder_mesh/quality.json"),
    )
    return [_record(pad, *products) for pad in read_json(run_folder / "reflow/pads.json")]


def _record(pad: Mapping, reflow: Mapping, surfaces: Mapping, quality: Mapping) -> dict:
    name = pad["name"]
    surface = surfaces.get(name, {})
    joint = {} if "given" in surface else reflow.get(name, {})
    metrics = {key: metric["value"] for key, metric in joint.get("metrics", {}).items()}
    surface = {key: np.degrees(value) if "angle" in key else value for key, value in surface.items()}
    verdict = {"shape": joint.get("shape", name), "verdict": joint.get("verdict", "given")}
    verdict |= {"given": joint["given"]} if "given" in joint else {}
    record: dict[str, Any] = {**surface, **pad, **verdict, **metrics, **quality.get(name, {})}
    angles = (record.get("contact_angle_board"), record.get("contact_angle_package"))
    if None not in angles:
        record["angles"] = f"{angles[0]:.1f} / {angles[1]:.1f}"
    tilt = float(np.hypot(*pad.get("tilt", (0.0, 0.0))))
    return record | ({"tilted": tilt} if tilt else {})


def by_shape(joints: Sequence[Record]) -> list[tuple[list[str], list[Record]]]:
    """Return names and records of the joints of each distinct shape, by increasing standoff of the first joint.

    Args:
        joints: Records of ``joint_records``; joints with equal ``shape`` are one group.

    Returns:
        Names and records of each group.
    """
    groups: dict[str, list[Record]] = {}
    for joint in joints:
        groups.setdefault(joint["shape"], []).append(joint)
    ordered = sorted(groups.values(), key=lambda group: group[0]["standoff"])
    return [([joint["name"] for joint in group], group) for group in ordered]


def bridge_records(run_folder: Path) -> list[dict]:
    """Return one record for each bridged pair: name ("A9+A10") and mesh quality; empty if none was meshed.

    Args:
        run_folder: Run folder, of which ``solder_mesh/bridged_quality.json`` is read if it exists.
    """
    quality = _optional(run_folder / "solder_mesh/bridged_quality.json")
    return [{"name": name, "shape": name, "standoff": 0.0} | measures for name, measures in quality.items()]


def _optional(path: Path) -> dict:
    return read_json(path) if path.exists() else {}


def record_table(columns: Iterable[Column], groups: list, chosen: Callable[[str, list], Any]) -> dict:
    """Return a table with one row per group of joints, and the columns that occur in any of the records.

    Args:
        columns: Column title, key of the records, and function from the chosen value to its text.
        groups: Names and records of each group, as from ``by_shape``.
        chosen: Function of the key and all values of a group, which returns the value to write.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text); a missing value is "–".
    """
    present = [column for column in columns if any(column[1] in joint for _, group in groups for joint in group)]
    rows = [[" ".join(names), *(_text(column, group, chosen) for column in present)] for names, group in groups]
    return {"head": ["joints", *(head for head, _, _ in present)], "rows": rows}


def _text(column: Column, group: Sequence[Record], chosen: Callable[[str, list], Any]) -> str:
    _, key, text = column
    values = [joint[key] for joint in group if key in joint]
    return text(chosen(key, values)) if values else "–"
