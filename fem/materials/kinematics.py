"""What small kinematics leave out of a run, in words."""

from typing import Literal

NEGLIGIBLE_STRAIN = 1e-4  # a tenth or less of the strains for which boards are tested


def finite_rotation(
    table: str, kinematics: Literal["small", "finite"], neglected_strain: float | None = None
) -> tuple[bool, str]:
    """Return whether rotations are finite, and why.

    Args:
        table: Table of the case that has the key ``kinematics``.
        kinematics: Its value.
        neglected_strain: Largest strain that a run of small kinematics has left out; None before a run.
    """
    finite, why = kinematics == "finite", f"{table}.kinematics = {kinematics}"
    if not finite and neglected_strain is not None:
        strain = f"{float(f'{1e6 * neglected_strain:.3g}'):g} µm/m"
        why += f"; it leaves out strains of up to {strain} (half the squared displacement gradient)"
        if neglected_strain > NEGLIGIBLE_STRAIN:
            why += f": not negligible, compare with a run of {table}.kinematics = finite"
    return finite, why
