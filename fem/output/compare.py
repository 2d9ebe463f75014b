"""Compare the histories of a two-scale run with those of a DNS. Plain NumPy."""

from collections.abc import Collection
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

COMPARED = {"die_displacement": "die_centre", "board_displacement": "board_centre", "board_strain": "board_strain"}


def relative_error(values: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    """Return the relative L2 norm over time and components, |values - reference| / |reference|."""
    scale = float(np.linalg.norm(reference))
    return float(np.linalg.norm(values - reference)) / scale if scale > 0.0 else float(np.linalg.norm(values))


def compare_histories(two_scale: Path, dns: Path, fine: Collection[str] | None = None) -> dict[str, float | str]:
    """Compare two ``history.npz``.

    Args:
        two_scale: Of the two-scale run.
        dns: Of the reference.
        fine: Joints that the two-scale run has fine; None if all.

    Returns:
        ``critical_joint`` (largest interface-averaged von Mises of the DNS); relative L2 errors:
        ``critical_joint_stress_error`` (its board and package side), ``worst_joint_stress_error`` (of the fine ones),
        ``die_displacement_error`` and ``board_displacement_error`` (their centres), ``board_strain_error``; with
        ``fine`` also ``critical_joint_coarse``: 1 if the critical joint is not among them; of a DNS that ends early
        ``compared_duration`` [s].

    A reference that ends early is compared with over the time that it has; the critical joint is then that of the
    two-scale run.

    Raises:
        ValueError: The files have different sample times or joints, or the reference lasts longer.
    """
    with np.load(two_scale) as first, np.load(dns) as second:
        ours, reference = dict(first), dict(second)
    count = len(reference["time"])
    same = len(ours["time"]) >= count and np.allclose(ours["time"][:count], reference["time"], rtol=1e-9)
    if not same or not np.array_equal(ours["joints"], reference["joints"]):
        raise ValueError(f"{two_scale} and {dns} have different sample times or joints and cannot be compared")
    result: dict[str, float | str] = {
        f"{name}_error": relative_error(ours[array][:count], reference[array]) for name, array in COMPARED.items()
    }
    if count < len(ours["time"]):
        result["compared_duration"] = float(reference["time"][-1])
    if len(reference["joints"]):
        result |= joint_errors(ours, reference, fine)
    return result


def joint_errors(
    ours: dict[str, NDArray], reference: dict[str, NDArray], fine: Collection[str] | None
) -> dict[str, float | str]:
    """Return the errors of the joints' interface-averaged von Mises histories."""
    layers = ("von_mises_board", "von_mises_package")
    values = np.stack([ours[name] for name in layers])
    exact = np.stack([reference[name] for name in layers])
    count = exact.shape[1]
    longest = exact if count == values.shape[1] else values
    critical = int(np.argmax(longest.max(axis=(0, 1))))
    errors = [relative_error(values[:, :count, j], exact[:, :, j]) for j in range(exact.shape[2])]
    names = [str(name) for name in reference["joints"]]
    compared = [error for name, error in zip(names, errors, strict=True) if fine is None or name in fine]
    return {
        "critical_joint": names[critical],
        "critical_joint_stress_error": errors[critical],
        "worst_joint_stress_error": max(compared),
        **({} if fine is None else {"critical_joint_coarse": float(names[critical] not in fine)}),
    }
