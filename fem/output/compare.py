"""Comparison of the histories of a two-scale run with a DNS."""

from collections.abc import Collection
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.output.ranking import ENDS, PEEL, PLASTIC_WORK, VON_MISES, Measure, critical_joint

COMPARED = {"die_displacement": "die_centre", "board_displacement": "board_centre", "board_strain": "board_strain"}


def relative_error(values: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    """Return the relative L2 error over all entries, |values - reference| / |reference|.

    If the reference is zero, the absolute norm |values| is returned.

    Args:
        values: Array of any shape.
        reference: Array of the same shape.
    """
    scale = float(np.linalg.norm(reference))
    return float(np.linalg.norm(values - reference)) / scale if scale > 0.0 else float(np.linalg.norm(values))


def compare_histories(two_scale: Path, dns: Path, fine: Collection[str] | None = None) -> dict[str, float | str]:
    """Compare the ``history.npz`` files of a two-scale run and a DNS (one model without scales).

    If the DNS ends early, only its duration is compared, and the two-scale run determines the critical joint.

    Args:
        two_scale: History file of the two-scale run, read only.
        dns: History file of the reference, read only.
        fine: Fine joints of the two-scale run, None if all are fine.

    Returns:
        ``critical_joint`` of the DNS (see ``ranking``) and relative L2 errors: ``critical_joint_stress_error`` (von
        Mises stress of its layers at board and package), ``worst_joint_stress_error`` (over the fine joints),
        ``critical_joint_peel_error``, ``critical_joint_work_error`` (only with plasticity), ``die_displacement_error``
        and ``board_displacement_error`` (at the centres), ``board_strain_error``. With ``fine`` also
        ``critical_joint_coarse``, 1 if the critical joint is not fine. For a DNS that ends early also
        ``compared_duration`` [s] and ``compared_stress``, the critical joint's peak until then over its overall peak.

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
        result |= _joint_errors(ours, reference, fine)
    return result


def _joint_errors(
    ours: dict[str, NDArray], reference: dict[str, NDArray], fine: Collection[str] | None
) -> dict[str, float | str]:
    """Return the errors of the joint histories, with board and package side combined."""
    count = len(reference["time"])
    whole = count == len(ours["time"])
    critical = critical_joint(reference if whole else ours)
    stress = VON_MISES.worse(ours)[:, critical]
    partial = {} if whole or not stress.any() else {"compared_stress": float(stress[:count].max() / stress.max())}

    def error(measure: Measure, joint: int) -> float:
        names = [f"{measure.history}_{end}" for end in ENDS]
        values, exact = (np.stack([arrays[name][:count, joint] for name in names]) for arrays in (ours, reference))
        return relative_error(values, exact)

    names = [str(name) for name in reference["joints"]]
    errors = [error(VON_MISES, joint) for joint in range(len(names))]
    flow = {"critical_joint_work_error": error(PLASTIC_WORK, critical)} if "plastic_work_board" in reference else {}
    return {
        "critical_joint": names[critical],
        "critical_joint_stress_error": errors[critical],
        "worst_joint_stress_error": max(
            value for name, value in zip(names, errors, strict=True) if fine is None or name in fine
        ),
        "critical_joint_peel_error": error(PEEL, critical),
        **flow,
        **partial,
        **({} if fine is None else {"critical_joint_coarse": float(names[critical] not in fine)}),
    }
