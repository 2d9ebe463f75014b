"""Parameters of the trials of elements and of coupled models.

All values are SI floats; see ``meshing.board.parameters`` for what the unit strings mean.
"""

from typing import Annotated, Literal

from pydantic import Field

from reflowshock.parameters import Parameters

Element = Literal["incompatible_modes", "one_point", "tetrahedron", "tetrahedron_quadratic"]
Hexahedron = Literal["incompatible_modes", "one_point"]
Kinematics = Literal["small", "finite"]
Seed = Annotated[int, Field(ge=0)]


class Elastic(Parameters):
    """An elastic body of distorted elements.

    ``orthotropy`` is the modulus in x and y over that in z. Nodes are moved at random until the least scaled Jacobian
    is ``quality``; boxes are ``aspect`` times as long in x and y as in z.
    """

    element: Element = "incompatible_modes"
    poisson_ratio: float = Field(0.3, gt=-1, lt=0.5)
    orthotropy: float = Field(1.0, ge=0.01, le=100)
    quality: float = Field(1.0, ge=0.02, le=1)
    aspect: float = Field(1.0, ge=1, le=100)
    cells: int = Field(3, ge=1, le=8)
    seed: Seed = 3


class Patch(Elastic):
    """A body whose nodes all move with one affine field; finite kinematics also strain it much."""

    kinematics: Kinematics = "small"


class Turns(Elastic):
    """A body that is turned, rigid, in quarter turns."""

    turns: int = Field(100, ge=1, le=1000)


class Bending(Parameters):
    """A beam of ``cells`` boxes along, across and up, of an aspect each, under a force at its end."""

    element: Element = "incompatible_modes"
    poisson_ratio: float = Field(0.0, ge=0, lt=0.5)
    aspect: float = Field(1.0, ge=1, le=100)
    cells: tuple[int, int, int] = (16, 2, 4)


class Order(Parameters):
    """A cube of ever smaller elements, none of them a box."""

    element: Element = "incompatible_modes"
    poisson_ratio: float = Field(0.3, ge=0, lt=0.5)


class Hinge(Parameters):
    """A beam of layers of elements that is bent to six times the curvature at which it yields."""

    element: Hexahedron = "one_point"
    layers: int = Field(2, ge=1, le=4)


class Tension(Elastic):
    """A body of a metal with linear hardening that is pulled to a plastic strain, and turned if that may be large."""

    kinematics: Kinematics = "small"
    plastic_strain: float = Field(0.02, gt=0, le=1)
    steps: int = Field(3, ge=1, le=1000)


class Compression(Elastic):
    """An elastic body in a channel that is pressed to a fraction of its length, or pulled."""

    stretch: float = Field(0.5, ge=0.05, le=10)
    steps: int = Field(200, ge=10, le=5000)


class Flight(Elastic):
    """A free body with energy in all its modes, that flies for some steps.

    Its upper half is ``contrast`` times softer, a ``foil`` of copper may lie between, with its mass scaled to the step
    of the others. The step is a fraction of the critical one of elements or of the assembled body. Damping alpha M +
    beta K is given as alpha dt and beta over the undamped step.
    """

    kinematics: Kinematics = "small"
    contrast: float = Field(1.0, ge=1, le=1e6)
    foil: Annotated[float, "um"] = Field(0.0, ge=0, le=1e-3)
    mass_scaled: bool = False
    critical_step: Literal["element", "power_iteration"] = "element"
    step_fraction: float = Field(0.99, gt=0, le=3)
    steps: int = Field(10_000, ge=10, le=100_000)
    mass_damping: float = Field(0.0, ge=0, le=1)
    stiffness_damping: float = Field(0.0, ge=0, le=1)


class Impact(Parameters):
    """A rod of solder that strikes a rigid wall; its sections lean by ``skew``."""

    element: Hexahedron = "one_point"
    kinematics: Kinematics = "finite"
    speed: Annotated[float, "m/s"] = Field(60.0, gt=0, le=300)
    skew: float = Field(0.0, ge=0, le=3)
    step_fraction: float = Field(0.6, gt=0, le=0.95)
    steps: int = Field(400, ge=10, le=5000)


class Tied(Parameters):
    """Two blocks of one footprint under tension, tied by faces with ``ratio`` times as many elements each way."""

    element: Hexahedron = "incompatible_modes"
    coarse: int = Field(2, ge=1, le=6)
    ratio: float = Field(1.5, ge=1, le=4)
    contrast: float = Field(1.0, ge=1e-4, le=1e4)
    quality: float = Field(1.0, ge=0.1, le=1)
    seed: Seed = 3


class PulseTrial(Parameters):
    """A free block under a pulse of acceleration whose duration is counted in steps."""

    pulse: Literal["half_sine", "haversine", "constant", "triangle"] = "half_sine"
    steps: float = Field(20.0, gt=0, le=1000)
    peak: Annotated[float, "G"] = Field(14709.975, ge=0)


SchemeOfTrial = Literal[
    "held_velocity", "impulse", "gravouil_combescure", "local_steps", "local_steps, levels auto", "as_printed"
]


class PairTrial(Parameters):
    """A board and a finer block tied to it off its grid, coupled by a scheme.

    ``substeps`` is m; ``impedance`` and ``mesh_ratio`` are of block over board and of their elements; ``orthotropy`` is
    the board's modulus in plane over that across (0: FR4's). The top layer of the block is thinner by ``thinnest``.
    The scheme ``as_printed`` is the paper's.
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
    """A pair that swings for some windows; ``free`` ones are held nowhere."""

    free: bool = False
    windows: int = Field(10_000, ge=400, le=1_000_000)


class PairTransfer(PairTrial):
    """A pair whose block is a little off the board's face."""

    offset: Annotated[float, "nm"] = Field(0.0, ge=-1e-6, le=1e-6)


class Yielding(Parameters):
    """A pair whose block is of solder that yields."""

    scheme: Literal["held_velocity", "impulse", "gravouil_combescure"] = "held_velocity"
    mesh_ratio: float = Field(2.0, ge=1, le=8)
    speed: Annotated[float, "m/s"] = Field(20.0, gt=0, le=100)
    windows: int = Field(300, ge=20, le=10_000)


class Reflection(Parameters):
    """A pulse, some elements long, that runs along a bar of board into a finer bar tied to its end."""

    scheme: Literal["held_velocity", "impulse", "gravouil_combescure", "local_steps"] = "held_velocity"
    substeps: int = Field(4, ge=1, le=20)
    impedance: float = Field(1.0, ge=0.1, le=10)
    mesh_ratio: int = Field(2, ge=1, le=4)
    elements: int = Field(20, ge=6, le=60)


class Layout(Parameters):
    """A board with joints that is hard to divide.

    ``copper_cut``: the cut goes through copper and board; ``overhang``: a plate thinner than its elements are long
    hangs over a joint; ``corner``: joint in a corner of the board; ``two_regions``: joints far apart.
    """

    layout: Literal["copper_cut", "overhang", "corner", "two_regions"] = "corner"
    scheme: Literal["held_velocity", "impulse", "gravouil_combescure", "local_steps"] = "local_steps"
