"""Parameters, in SI values, and measures of the trials of elements and of one moving model."""

from typing import Annotated, Literal

from pydantic import Field

from reflowshock.cases.hard.trial import pure_trial
from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

Element = Literal["incompatible_modes", "one_point", "tetrahedron", "tetrahedron_quadratic"]
Hexahedron = Literal["incompatible_modes", "one_point"]
Kinematics = Literal["small", "finite"]
Seed = Annotated[int, Field(ge=0)]


class Elastic(Parameters):
    """Elastic body of distorted elements.

    ``orthotropy`` is the modulus in x and y over the modulus in z. Nodes move at random until the least scaled Jacobian
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
    """Body with an affine displacement field, with large strains for finite kinematics."""

    kinematics: Kinematics = "small"


class Turns(Elastic):
    """Rigid body rotation in quarter turns."""

    turns: int = Field(100, ge=1, le=1000)


class Bending(Parameters):
    """Beam of ``cells`` boxes along, across and up, with an aspect ratio, under a tip force."""

    element: Element = "incompatible_modes"
    poisson_ratio: float = Field(0.0, ge=0, lt=0.5)
    aspect: float = Field(1.0, ge=1, le=100)
    cells: tuple[int, int, int] = (16, 2, 4)


class Order(Parameters):
    """Cube on a sequence of refined meshes without any box."""

    element: Element = "incompatible_modes"
    poisson_ratio: float = Field(0.3, ge=0, lt=0.5)


class Hinge(Parameters):
    """Layered beam bent to six times its yield curvature."""

    element: Hexahedron = "one_point"
    layers: int = Field(2, ge=1, le=4)


class Tension(Elastic):
    """Metal body with linear hardening under plastic tension, with rotation for finite kinematics."""

    kinematics: Kinematics = "small"
    plastic_strain: float = Field(0.02, gt=0, le=1)
    steps: int = Field(3, ge=1, le=1000)


class Compression(Elastic):
    """Confined elastic body under compression or tension."""

    stretch: float = Field(0.5, ge=0.05, le=10)
    steps: int = Field(200, ge=10, le=5000)


class Flight(Elastic):
    """Free body with energy in all modes for some steps.

    Its upper half is softer by ``contrast``, with an optional ``foil`` of copper between the halves, mass-scaled to the
    step of the others. The step is a fraction of the critical step of elements or of the assembled body. Damping alpha
    M + beta K is given as alpha dt and beta over the undamped step.
    """

    kinematics: Kinematics = "small"
    contrast: float = Field(1.0, ge=1, le=1e6)
    foil: Annotated[float, Quantity("um")] = Field(0.0, ge=0, le=1e-3)
    mass_scaled: bool = False
    critical_step: Literal["element", "power_iteration"] = "element"
    step_fraction: float = Field(0.99, gt=0, le=3)
    steps: int = Field(10_000, ge=10, le=100_000)
    mass_damping: float = Field(0.0, ge=0, le=1)
    stiffness_damping: float = Field(0.0, ge=0, le=1)


class Impact(Parameters):
    """Rod of solder that strikes a rigid wall, with sections inclined by ``skew``."""

    element: Hexahedron = "one_point"
    kinematics: Kinematics = "finite"
    speed: Annotated[float, Quantity("m/s")] = Field(60.0, gt=0, le=300)
    skew: float = Field(0.0, ge=0, le=3)
    step_fraction: float = Field(0.6, gt=0, le=0.95)
    steps: int = Field(400, ge=10, le=5000)


class Tied(Parameters):
    """Two blocks of one footprint under tension, tied by faces with a ratio of ``ratio`` elements in each direction."""

    element: Hexahedron = "incompatible_modes"
    coarse: int = Field(2, ge=1, le=6)
    ratio: float = Field(1.5, ge=1, le=4)
    contrast: float = Field(1.0, ge=1e-4, le=1e4)
    quality: float = Field(1.0, ge=0.1, le=1)
    seed: Seed = 3


class PulseTrial(Parameters):
    """Free block under an acceleration pulse with a duration in steps."""

    pulse: Literal["half_sine", "haversine", "constant", "triangle"] = "half_sine"
    steps: float = Field(20.0, gt=0, le=1000)
    peak: Annotated[float, Quantity("G")] = Field(14709.975, ge=0)


TRIALS = {
    "patch": pure_trial(Patch, "fields:patch", "force_error stress_error softest_mode rigid_mode"),
    "turns": pure_trial(Turns, "fields:turns", "force_error stress_error"),
    "tension": pure_trial(Tension, "fields:tension", "stress_error stress_scatter force_error"),
    "compression": pure_trial(Compression, "fields:compression", "stress_error stress_scatter force_error"),
    "tied_blocks": pure_trial(Tied, "fields:tied", "stress_error mean_stress_error pull_error"),
    "bending": pure_trial(Bending, "beams:bending", "deflection_error"),
    "order": pure_trial(Order, "beams:order", "displacement_order strain_order"),
    "hinge": pure_trial(Hinge, "beams:hinge", "moment_error"),
    "flight": pure_trial(
        Flight, "motion:flight", "energy_error momentum_error angular_momentum_error energy_left step_gain"
    ),
    "impact": pure_trial(Impact, "motion:impact", "energy_error plastic_share plastic_return hourglass_share"),
    "pulse": pure_trial(PulseTrial, "motion:pulse", "velocity_error displacement_error strain_energy energy_error"),
}
