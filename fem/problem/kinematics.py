"""Kinematics of elements: small, corotational or finite.

``small`` assumes small rotations and strains. ``corotational`` allows finite rotations; elastic hexahedra have small
strains in the rotating frame, at a fraction of the cost of ``finite``, which allows finite rotations and strains.
Plastic materials are computed in the same way with ``corotational`` and ``finite``.
"""

from typing import Literal

Kinematics = Literal["small", "corotational", "finite"]
TURNING: tuple[Kinematics, ...] = ("corotational", "finite")

NEGLIGIBLE_STRAIN = 1e-4  # at most a tenth of the strains in board-level tests


def finite_rotation(table: str, kinematics: Kinematics, neglected_strain: float | None = None) -> tuple[bool, str]:
    """Return whether rotations are finite (any kinematics but "small"), and the reason as text.

    Args:
        table: Table of the case file that has the key ``kinematics``.
        kinematics: Value of that key.
        neglected_strain: Largest strain that the kinematics neglected in a run, which is added to the reason; None
            before a run.
    """
    turns, why = kinematics != "small", f"{table}.kinematics = {kinematics}"
    if kinematics != "finite" and neglected_strain is not None:
        strain = f"{float(f'{1e6 * neglected_strain:.3g}'):g} µm/m"
        why += f"; it neglects strains of up to {strain} (half the squared "
        why += "strain)" if turns else "displacement gradient)"
        if neglected_strain > NEGLIGIBLE_STRAIN:
            why += f": not negligible, compare with a run of {table}.kinematics = finite"
    return turns, why
