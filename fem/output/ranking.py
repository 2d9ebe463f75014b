"""Ranking of joints from the histories of a shock, by measures that converge with the mesh.

The stress of yielding solder hardly grows with its plastic strain, so joints are then ranked by the plastic work
density of the layer at a pad; otherwise by peel stress, which ranks measured impact lives (Tee, Ng & Lim).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ENDS = ("board", "package")
Arrays = Mapping[str, NDArray]


@dataclass(frozen=True, slots=True)
class Measure:
    """Measure of the load on the worse pad of a joint.

    Attributes:
        history: Prefix of the histories ``<history>_board`` and ``<history>_package``.
        name: Name in reports.
        unit: SI unit.
    """

    history: str
    name: str
    unit: str

    def worse(self, arrays: Arrays) -> NDArray[np.float64]:
        """Return the larger value of both ends, shape (times, joints)."""
        return np.maximum(*(arrays[f"{self.history}_{end}"] for end in ENDS))

    def peaks(self, arrays: Arrays) -> NDArray[np.float64]:
        """Return the peak over time and ends, shape (joints,)."""
        return np.asarray(self.worse(arrays).max(axis=0))

    def worse_end(self, arrays: Arrays, joint: int) -> str:
        """Return the end at which the measure peaks, for the joint of a given number."""
        return max(ENDS, key=lambda end: float(arrays[f"{self.history}_{end}"][:, joint].max()))


PEEL = Measure("peel", "peel stress", "Pa")
VON_MISES = Measure("von_mises", "von Mises stress of the layer", "Pa")
PLASTIC_STRAIN = Measure("plastic_strain", "plastic strain of the layer", "")
PLASTIC_WORK = Measure("plastic_work", "plastic work density of the layer", "J/m^3")
OUTER_FIBRE = Measure("outer_fibre", "outer-fibre stress", "Pa")
PLASTIC_FLOW = {"layer_plastic_strain": PLASTIC_STRAIN, "layer_plastic_work": PLASTIC_WORK}  # if solder yields


def has_flow(arrays: Arrays) -> bool:
    """Return whether the solder of a shock may yield, from the arrays of its ``history.npz``."""
    return "plastic_strain_max" in arrays


def joint_figures(arrays: Arrays, joint: int) -> dict[str, tuple[float, str]]:
    """Return the peaks over time of stresses and section forces on the worse pad of a joint.

    Args:
        arrays: Arrays of ``history.npz`` of a shock, with one column per joint.
        joint: Column of the joint.

    Returns:
        Name -> value and SI unit: ``peel_stress``, ``layer_von_mises``, ``outer_fibre_stress`` [Pa], plastic strain and
        work density if solder may yield, ``section_axial_force``, ``section_shear_force`` [N],
        ``section_torsion_moment`` and ``section_bending_moment`` [N m].
    """
    sections = np.stack([arrays[f"section_{end}"][:, joint] for end in ENDS])
    flows = PLASTIC_FLOW if has_flow(arrays) else {}
    measures = {"peel_stress": PEEL, "layer_von_mises": VON_MISES, **flows, "outer_fibre_stress": OUTER_FIBRE}
    forces = {
        "section_axial_force": (float(sections[..., 0].max()), "N"),
        "section_shear_force": (float(np.hypot(sections[..., 1], sections[..., 2]).max()), "N"),
        "section_torsion_moment": (float(np.abs(sections[..., 3]).max()), "N m"),
        "section_bending_moment": (float(np.hypot(sections[..., 4], sections[..., 5]).max()), "N m"),
    }
    return {name: (float(item.peaks(arrays)[joint]), item.unit) for name, item in measures.items()} | forces


def ranking_measure(arrays: Arrays) -> Measure:
    """Return the measure by which joints are ranked: plastic work density if any solder has yielded, else peel stress.

    Args:
        arrays: Arrays of ``history.npz``: ``peel_<end>`` [Pa] and, with plasticity, ``plastic_work_<end>`` for the ends
            ``board`` and ``package``, each of shape (times, joints).

    Returns:
        Measure with methods that return its histories and peaks from such arrays.
    """
    yielded = "plastic_work_board" in arrays and bool(PLASTIC_WORK.peaks(arrays).max(initial=0.0) > 0.0)
    return PLASTIC_WORK if yielded else PEEL


def rank_joints(arrays: Arrays) -> NDArray[np.intp]:
    """Return the joint numbers, critical joint first, shape (joints,).

    They are ordered by the peak of plastic work density if any solder has yielded, else of peel stress; equal peaks of
    work are ordered by peel stress.

    Args:
        arrays: Arrays of ``history.npz``: ``peel_<end>`` [Pa] and, with plasticity, ``plastic_work_<end>`` for the ends
            ``board`` and ``package``, each of shape (times, joints).
    """
    return np.lexsort((-PEEL.peaks(arrays), -ranking_measure(arrays).peaks(arrays)))


def critical_joint(arrays: Arrays) -> int:
    """Return the index of the critical joint.

    It has the largest peak of plastic work density if any solder has yielded, else of peel stress.

    Args:
        arrays: Arrays of ``history.npz``: ``peel_<end>`` [Pa] and, with plasticity, ``plastic_work_<end>`` for the ends
            ``board`` and ``package``, each of shape (times, joints).
    """
    return int(rank_joints(arrays)[0])
