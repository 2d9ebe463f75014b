"""Compare the histories of a two-scale run with those of a DNS. Plain NumPy."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

COMPARED = {"die_displacement": "die_centre", "board_displacement": "board_centre", "board_strain": "board_strain"}


def relative_error(values: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    """Return the relative L2 norm over time and components, |values - reference| / |reference|."""
    scale = float(np.linalg.norm(reference))
    return float(np.linalg.norm(values - reference)) / scale if scale > 0.0 else float(np.linalg.norm(values))


def compare_histories(two_scale: Path, dns: Path) -> dict[str, float | str]:
    """Compare two ``history.npz``.

    Returns:
        ``critical_joint`` (largest interface-averaged von Mises of the DNS); relative L2 errors:
        ``critical_joint_stress_error`` (its board and package side), ``worst_joint_stress_error``,
        ``die_displacement_error`` and ``board_displacement_error`` (their centres), ``board_strain_error``.

    Raises:
        ValueError: The files have different sample times or joints.
    """
    with np.load(two_scale) as first, np.load(dns) as second:
        ours, reference = dict(first), dict(second)
    same = len(ours["time"]) == len(reference["time"]) and np.allclose(ours["time"], reference["time"], rtol=1e-9)
    if not same or not np.array_equal(ours["joints"], reference["joints"]):
        raise ValueError(f"{two_scale} and {dns} have different sample times or joints and cannot be compared")
    result: dict[str, float | str] = {
        f"{name}_error": relative_error(ours[array], reference[array]) for name, array in COMPARED.items()
    }
    if len(reference["joints"]):
        result |= joint_errors(ours, reference)
    return result


def joint_errors(ours: dict[str, NDArray], reference: dict[str, NDArray]) -> dict[str, float | str]:
    """Return the errors of the joints' interface-averaged von Mises histories."""
    layers = ("von_mises_board", "von_mises_package")
    values = np.stack([ours[name] for name in layers])
    exact = np.stack([reference[name] for name in layers])
    critical = int(np.argmax(exact.max(axis=(0, 1))))
    errors = [relative_error(values[:, :, j], exact[:, :, j]) for j in range(exact.shape[2])]
    return {
        "critical_joint": str(reference["joints"][critical]),
        "critical_joint_stress_error": errors[critical],
        "worst_joint_stress_error": max(errors),
    }
