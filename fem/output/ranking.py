"""Which joint is critical, from the histories of a shock: by measures that converge with the mesh. Plain NumPy.

Solder that yields carries little more stress however much it flows: there joints rank by the plastic work density of
the layer at a pad, else by peel stress, which ranks measured impact lives (Tee, Ng & Lim).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ENDS = ("board", "package")
Arrays = Mapping[str, NDArray]


@dataclass(frozen=True, slots=True)
class Measure:
    """A measure of what the worse pad of a joint bears.

    Attributes:
        history: Its histories are ``<history>_board`` and ``<history>_package``.
        name: For people.
        unit: SI.
    """

    history: str
    name: str
    unit: str

    def worse(self, arrays: Arrays) -> NDArray[np.float64]:
        """Return the larger of both ends ``(times, joints)``."""
        return np.maximum(*(arrays[f"{self.history}_{end}"] for end in ENDS))

    def peaks(self, arrays: Arrays) -> NDArray[np.float64]:
        """Return its peak over time and ends ``(joints,)``."""
        return np.asarray(self.worse(arrays).max(axis=0))

    def worse_end(self, arrays: Arrays, joint: int) -> str:
        """Return the end of a joint, by its number, at which it peaks."""
        return max(ENDS, key=lambda end: float(arrays[f"{self.history}_{end}"][:, joint].max()))


PEEL = Measure("peel", "peel stress", "Pa")
VON_MISES = Measure("von_mises", "von Mises stress of the layer", "Pa")
PLASTIC_STRAIN = Measure("plastic_strain", "plastic strain of the layer", "")
PLASTIC_WORK = Measure("plastic_work", "plastic work density of the layer", "J/m^3")
OUTER_FIBRE = Measure("outer_fibre", "outer-fibre stress", "Pa")


def ranking_measure(arrays: Arrays) -> Measure:
    """Return the measure by which joints rank: plastic work where any solder has yielded, else peel stress."""
    yielded = "plastic_work_board" in arrays and bool(PLASTIC_WORK.peaks(arrays).max(initial=0.0) > 0.0)
    return PLASTIC_WORK if yielded else PEEL


def ranked(arrays: Arrays) -> NDArray[np.intp]:
    """Return the numbers of the joints ``(joints,)``, the critical one first; equal ones by peel stress."""
    return np.lexsort((-PEEL.peaks(arrays), -ranking_measure(arrays).peaks(arrays)))


def critical_joint(arrays: Arrays) -> int:
    """Return the number of the critical joint."""
    return int(ranked(arrays)[0])
