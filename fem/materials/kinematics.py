"""Kinematics of elements, and what they leave out of a run, in words.

Small ones take rotations and strains as small. Corotational ones take rotations of any size and, where a material is
elastic and elements are hexahedra, small strains in the frame that turns: a fraction of the cost of finite ones, which
take rotations and strains of any size. Materials that yield are computed alike in both.
"""

from typing import Literal

Kinematics = Literal["small", "corotational", "finite"]
TURNING: tuple[Kinematics, ...] = ("corotational", "finite")

NEGLIGIBLE_STRAIN = 1e-4  # a tenth or less of the strains for which boards are tested


def finite_rotation(table: str, kinematics: Kinematics, neglected_strain: float | None = None) -> tuple[bool, str]:
    """Return whether rotations are finite, and why.

    Args:
        table: Table of the case that has the key ``kinematics``.
        kinematics: Its value.
        neglected_strain: Largest strain that a run has left out; None before a run.
    """
    turns, why = kinematics != "small", f"{table}.kinematics = {kinematics}"
    if kinematics != "finite" and neglected_strain is not None:
        strain = f"{float(f'{1e6 * neglected_strain:.3g}'):g} µm/m"
        why += f"; it leaves out strains of up to {strain} (half the squared "
        why += "strain)" if turns else "displacement gradient)"
        if neglected_strain > NEGLIGIBLE_STRAIN:
            why += f": not negligible, compare with a run of {table}.kinematics = finite"
    return turns, why
