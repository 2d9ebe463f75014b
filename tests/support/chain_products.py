"""Synthetic products of the full chain: a bowed structure, identical joints, stresses at the package pads."""

import json
import shutil
from pathlib import Path

import numpy as np

MILLI, MICRO = 1e-3, 1e-6
STEPS = np.array([298.15, 380.0, 450.0, 490.15])  # K
BOW = {"board": 12 * MICRO, "package": 70 * MICRO}  # at the corner, in the last step


def bowed_structure(names: list[str], x: np.ndarray, y: np.ndarray, half: float = 5.5 * MILLI) -> dict[str, np.ndarray]:
    """Return the products of a reflow: package underside and top face of the board as paraboloids.

    Args:
        names: Names of the joints.
        x, y: Positions of the joints [m].
        half: Half the length of the package [m]; a quarter of it is modelled.

    Returns:
        Arrays of ``structure.npz`` by name: nodes ``points`` [m] with ``displacement`` [m] and ``package``,
        ``temperature`` [K] and residuals of each step, ``pad_motion`` and names of the ``joints``.
    """
    step = 0.5 * MILLI
    lines = {"package": np.arange(0.0, half + 0.1 * step, step), "board": np.arange(0.0, 3 * half, step)}
    faces, lifts = [], []
    for part, height in (("package", 0.34 * MILLI), ("board", 0.0)):
        places = np.stack(np.meshgrid(lines[part], lines[part]), axis=-1).reshape(-1, 2)
        faces.append(np.column_stack([places, np.full(len(places), height)]))
        lifts.append(_lift(part, *places.T, half))
    displacement = np.concatenate([np.column_stack([0 * lift, 0 * lift, lift]) for lift in lifts])
    motion = np.zeros((len(STEPS), len(names), 2, 6))
    for side, part in enumerate(("board", "package")):
        share = (STEPS - STEPS[0]) / np.ptp(STEPS)
        motion[:, :, side, 2] = share[:, None] * _lift(part, x, y, half)
    return {
        "points": np.concatenate(faces), "displacement": displacement,
        "package": np.repeat([True, False], [len(face) for face in faces]),
        "temperature": STEPS, "corner_displacement": np.zeros(len(STEPS)), "iterations": np.array([1, 3, 3, 4]),
        "force_residual": np.array([0.0, 2e-4, 3e-4, 6e-4]), "rigid_residual": np.zeros(len(STEPS)),
        "pad_motion": motion, "joints": np.array(names),
    }  # fmt: skip


def _lift(part: str, x: np.ndarray, y: np.ndarray, half: float) -> np.ndarray:
    return BOW[part] * (x**2 + y**2) / (2 * half**2)


def interface(
    names: list[str], x: np.ndarray, y: np.ndarray, times: np.ndarray, factor: float = 1.0
) -> dict[str, np.ndarray]:
    """Return stresses on the package pads of joints, 16 faces each, increasing outwards.

    Args:
        names: Names of the joints.
        x: First coordinates of the joints, shape (n,) [m].
        y: Second coordinates of the joints, shape (n,) [m].
        times: Times of the samples, shape (s,) [s].
        factor: Factor of all stresses.

    Returns:
        ``times``, and for each joint ``points@NAME`` [m], ``quads@NAME`` and ``von_mises@NAME``, shape (s, 16) [Pa].
    """
    line = np.linspace(-0.17 * MILLI, 0.17 * MILLI, 5)
    grid = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    corner = np.arange(25).reshape(5, 5)
    quads = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1).reshape(-1, 4)
    arrays: dict[str, np.ndarray] = {"times": times}
    for name, position in zip(names, np.column_stack([x, y]), strict=True):
        points = np.column_stack([grid + position, np.full(25, 0.4 * MILLI)])
        middle = points[quads].mean(axis=1)
        stress = factor * 2e6 * (middle[:, 0] + middle[:, 1]) / MILLI
        arrays |= {f"points@{name}": points, f"quads@{name}": quads}
        arrays[f"von_mises@{name}"] = np.outer(times / times[-1], stress)
    return arrays


def add_chain(run: Path) -> None:
    """Add files of heated package, interface stresses and identical joints to the run folder of a dropped package."""
    pads = json.loads((run / "reflow/pads.json").read_text())
    names = [pad["name"] for pad in pads]
    x, y = (np.array([pad[axis] for pad in pads]) for axis in "xy")
    np.savez(run / "reflow/structure.npz", **bowed_structure(names, x, y))
    modes = [mode for mode in ("two_scale", "dns") if (run / "shock" / mode).is_dir()]
    for mode in modes:
        factor = 1.0 if mode == "dns" else 1.01
        np.savez(run / f"shock/{mode}/interface.npz", **interface(names, x, y, np.array([1.085e-3]), factor))
    identical = run / "shock/identical"
    identical.mkdir(exist_ok=True)
    shutil.copy(run / f"shock/{modes[0]}/result.json", identical)
    with np.load(run / f"shock/{modes[0]}/history.npz") as arrays:
        history = dict(arrays)
    history |= {name: 1.1 * history[name] for name in ("peel_board", "peel_package")}
    np.savez(identical / "history.npz", **history)
