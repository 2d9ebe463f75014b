"""Base of the effects of a reflow: a liquid scene and its dimensionless numbers; loads no numerical library."""

from abc import abstractmethod
from dataclasses import dataclass
from math import exp, pi, sqrt

from reflowshock.effect import Decision, Effect, decision
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import Solder

# Ratio of process time to slowest time above which a motion has decayed.
PROCESS_TIME_RATIO = 20.0
# Largest Bond number at which surface tension determines the shape.
LARGEST_BOND = 100.0


@dataclass(frozen=True, slots=True)
class Numbers:
    """Dimensionless numbers and times of a joint or drop.

    Attributes:
        bond: Bond number rho g L H / gamma, weight over surface tension.
        ohnesorge: Ohnesorge number mu / sqrt(rho gamma L).
        capillary_time: Capillary time sqrt(rho L^3 / gamma) [s].
        viscous_time: Viscous time rho L^2 / (5 mu) [s], in which the slowest oscillation decays (Lamb 1932, mode 2).
    """

    bond: float
    ohnesorge: float
    capillary_time: float
    viscous_time: float


def dimensionless_numbers(geometry: JointGeometry, solder: Solder) -> Numbers:
    """Compute the dimensionless numbers of a joint of solder.

    The height H is the gap, the length L the radius of a cylinder of equal volume and height H.

    Args:
        geometry: Gap between the pads.
        solder: Volume, density, viscosity, surface tension and gravity.

    Returns:
        Bond and Ohnesorge number, capillary and viscous time [s].
    """
    length = sqrt(solder.volume / (pi * geometry.gap))
    return _numbers(solder, length, length * geometry.gap)


def drop_numbers(solder: Solder) -> Numbers:
    """Compute the dimensionless numbers of a drop from the properties of its solder.

    The Bond number refers to V^(1/3), the others to the radius of a sphere of equal volume.

    Returns:
        Bond and Ohnesorge number, capillary and viscous time [s].
    """
    return _numbers(solder, (0.75 * solder.volume / pi) ** (1.0 / 3.0), solder.volume ** (2.0 / 3.0))


def _numbers(solder: Solder, length: float, area: float) -> Numbers:
    """Compute the numbers from the length of the time scales [m] and the area of the Bond number [m^2]."""
    density, tension = solder.density, solder.surface_tension
    return Numbers(
        bond=density * solder.gravity * area / tension,
        ohnesorge=solder.viscosity / sqrt(density * tension * length),
        capillary_time=sqrt(density * length**3 / tension),
        viscous_time=density * length**2 / (5.0 * solder.viscosity),
    )


@dataclass(frozen=True, slots=True)
class LiquidScene:
    """Liquid solder in a scene.

    Attributes:
        numbers: Dimensionless numbers.
        solder: Properties and process.
        has_wall: Whether the solder touches a wall.
        swings: Whether the solder is an oscillating drop.
    """

    numbers: Numbers
    solder: Solder
    has_wall: bool = True
    swings: bool = False

    @property
    def rival(self) -> float:
        """Bond number of the weight that competes with surface tension; 0 for a free drop or without gravity."""
        return self.numbers.bond if self.has_wall and self.solder.effects.gravity != "off" else 0.0

    @property
    def shaped(self) -> float:
        """Fraction of the shape determined by surface tension: capillary length over size, 1 / sqrt(1 + Bo)."""
        return 1.0 / sqrt(1.0 + self.rival)

    @property
    def slowest_time(self) -> float:
        """Time in which the slowest motion decays [s]."""
        return max(self.numbers.capillary_time, self.numbers.viscous_time)

    @property
    def is_transient(self) -> bool:
        """Whether the process ends before the motion has decayed."""
        return self.solder.process_time / self.slowest_time < PROCESS_TIME_RATIO


class LiquidEffect(Effect[LiquidScene]):
    """Effect of a reflow: ``implementation`` names its ``Acting`` class, and ``SolderEffects`` holds its switch.

    Attributes:
        of_motion: Whether the effect vanishes at rest.
        needs_wall: Whether the effect acts only on solder that touches a wall.
        without_wall: Reason why the effect is off without a wall.
        is_axisymmetric: Whether a drop keeps its axis and its planes of symmetry. Otherwise it has no Young-Laplace
            reference and cannot be computed in part or in section.
        section_implementation: Dotted name of the ``Acting`` class for a drop in section, if it is another one.
        is_measured: Whether ``benchmarks/effects.py`` measures the cost of the effect per step.
    """

    stage = "reflow"
    of_motion = False
    needs_wall = False
    without_wall = "no wall"
    is_axisymmetric = True
    section_implementation: str = ""
    is_measured = False

    @property
    def key(self) -> str:
        """Key of the switch in a case of solder alone."""
        return f"solder.effects.{self.name}"

    @abstractmethod
    def auto(self, liquid: LiquidScene) -> Decision:
        """Decide by the dimensionless numbers alone."""

    def decide(self, liquid: LiquidScene) -> Decision:
        """Decide by the user's switch, otherwise by the dimensionless numbers; off without a wall that it needs."""
        if self.needs_wall and not liquid.has_wall:
            return decision(False, self.without_wall)
        auto, switch = self.auto(liquid), getattr(liquid.solder.effects, self.name)
        if switch == "auto":
            return auto
        return auto | decision(switch == "on", f"set to {switch} by the user ({auto['why']})")

    def weight(self, solder: Solder) -> float:
        """Return the specific weight that the effect adds along -z [N/m^3]."""
        return 0.0


class MotionEffect(LiquidEffect):
    """Effect of the motion, which matters in short processes."""

    threshold = PROCESS_TIME_RATIO
    acts = "below"
    of_motion = True
    is_measured = True

    def auto(self, liquid: LiquidScene) -> Decision:
        """Decide by the ratio of process time to slowest time."""
        ratio = liquid.solder.process_time / liquid.slowest_time
        times = f"process time {liquid.solder.process_time:.3g} s is {ratio:.3g} times the slowest time"
        rest = "the motion matters" if liquid.is_transient else "quasi-static, only the shape at rest matters"
        return decision(liquid.is_transient, f"{times} {liquid.slowest_time:.3g} s: {rest}", exp(-ratio))
