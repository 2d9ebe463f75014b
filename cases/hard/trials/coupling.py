"""Parameters, in SI values, and measures of the trials of two coupled models."""

from typing import Annotated, Literal

from pydantic import Field

from reflowshock.cases.hard.trial import pure_trial
from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

SchemeOfTrial = Literal[
    "held_velocity", "impulse", "gravouil_combescure", "local_steps", "local_steps, levels auto", "as_printed"
]


class PairTrial(Parameters):
    """Board and a finer block tied to it off its grid, coupled by a scheme.

    ``substeps`` is m; ``impedance`` and ``mesh_ratio`` are block over board (impedances, element sizes); ``orthotropy``
    is the board's in-plane modulus over the modulus across (0: FR4). The top layer of the block is thinner by
    ``thinnest``. The scheme ``as_printed`` is the scheme as printed in the paper.
    """

    scheme: SchemeOfTrial = "held_velocity"
    substeps: int = Field(4, ge=1, le=40)
    impedance: float = Field(1.0, ge=0.1, le=10)
    mesh_ratio: float = Field(2.0, ge=1, le=8)
    shape: Literal["flat", "distorted", "curved"] = "flat"
    orthotropy: float = Field(0.0, ge=0, le=100)
    step_fraction: float = Field(0.9, gt=0, le=0.95)
    layers: int = Field(4, ge=3, le=8)
    columns: int = Field(3, ge=2, le=5)
    height: int = Field(2, ge=1, le=4)
    thinnest: float = Field(1.0, ge=0.05, le=1)


class PairRun(PairTrial):
    """Pair that oscillates for some windows; ``free`` pairs have no supports."""

    free: bool = False
    windows: int = Field(10_000, ge=400, le=1_000_000)


class PairTransfer(PairTrial):
    """Pair whose block is slightly off the board's face."""

    offset: Annotated[float, Quantity("nm")] = Field(0.0, ge=-1e-6, le=1e-6)


class Yielding(Parameters):
    """Pair with a block of yielding solder."""

    scheme: Literal["held_velocity", "impulse", "gravouil_combescure"] = "held_velocity"
    mesh_ratio: float = Field(2.0, ge=1, le=8)
    speed: Annotated[float, Quantity("m/s")] = Field(20.0, gt=0, le=100)
    windows: int = Field(300, ge=20, le=10_000)


class Reflection(Parameters):
    """Pulse of some elements' length that runs along a bar of board into a finer bar tied to its end."""

    scheme: Literal["held_velocity", "impulse", "gravouil_combescure", "local_steps"] = "held_velocity"
    substeps: int = Field(4, ge=1, le=20)
    impedance: float = Field(1.0, ge=0.1, le=10)
    mesh_ratio: int = Field(2, ge=1, le=4)
    elements: int = Field(20, ge=6, le=60)


class Layout(Parameters):
    """Board with joints that are hard to divide.

    ``copper_interface``: the interface crosses copper and board; ``overhang``: a plate thinner than the length of its
    elements hangs over a joint; ``corner``: joint in a corner of the board; ``two_regions``: distant joints.
    """

    layout: Literal["copper_interface", "overhang", "corner", "two_regions"] = "corner"
    scheme: Literal["held_velocity", "impulse", "gravouil_combescure", "local_steps"] = "local_steps"


TRANSFER = "rigid_error linear_error tie_error interface_error mass_error"
TRIALS = {
    "window": pure_trial(PairTrial, "windows:window", "growth substeps"),
    "windows": pure_trial(PairRun, "windows:run", "energy_drift interface_energy energy_error momentum_error"),
    "transfer": pure_trial(PairTransfer, "windows:transfer", TRANSFER),
    "restart": pure_trial(PairTrial, "windows:restart", "difference"),
    "yielding_pair": pure_trial(Yielding, "windows:yielding", "energy_error plastic_share interface_energy"),
    "reflection": pure_trial(
        Reflection, "windows:reflection", "reflection_error reflected energy_error interface_energy substeps"
    ),
    "layout": pure_trial(Layout, "layouts:layout", f"growth substeps {TRANSFER}"),
}
