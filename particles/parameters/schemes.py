"""Registry of the reflow schemes and their limits; loads no numerical library.

``scenes/step_methods.py`` has the step solvers of each scheme.
"""

from dataclasses import dataclass
from math import inf
from typing import Literal

Scheme = Literal["energy", "ispg", "gripc"]
SchemeOrAuto = Literal["auto", Scheme]
Wall = Literal["free-slip", "no-slip", "slip"]


@dataclass(frozen=True, slots=True)
class SchemeRecord:
    """Scheme of a reflow and its limits.

    Attributes:
        walls: Supported wall conditions.
        largest_time_step: Largest stable time step, in capillary limits.
        has_basis: Whether ``numerics.basis`` selects its basis.
        moves_plates: Whether plates may move.
        moves_at_speed: Whether a package may move at a speed, with inertia.
    """

    walls: tuple[Wall, ...] = ("free-slip", "no-slip", "slip")
    largest_time_step: float = inf
    has_basis: bool = False
    moves_plates: bool = True
    moves_at_speed: bool = False


SCHEMES: dict[Scheme, SchemeRecord] = {
    "energy": SchemeRecord(),
    "ispg": SchemeRecord(moves_at_speed=True),
    "gripc": SchemeRecord(walls=("free-slip",), largest_time_step=1.0, has_basis=True, moves_plates=False),
}
