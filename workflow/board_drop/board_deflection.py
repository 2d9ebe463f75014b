"""Estimated deflection of the board, and the kinematics and duration that follow from it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from reflowshock.effect import Decision
from reflowshock.fem.estimates.board_damping import with_estimate
from reflowshock.fem.estimates.drop_effect import Deflection
from reflowshock.fem.estimates.drop_effects import SolderPlasticity, called_for
from reflowshock.workflow.board_drop.duration import first_mode, longest_duration

if TYPE_CHECKING:
    from reflowshock.fem.problem.shock import Shock
    from reflowshock.materials.parameters import Material
    from reflowshock.materials.roles import Materials
    from reflowshock.workflow.package.case import BoardDropCase

SHARE = 4.0 / math.pi  # share of the base's acceleration that drives the middle of a pinned beam in its first mode
# From cases/jedec_bga: ratio of its period, 3.7 ms (280 Hz is measured on such boards), to the period of a pinned beam;
# and c of ``expected_duration``, which is small because the board is supported at four holes only.
PERIOD_RATIO, STRETCH = 0.58, 0.6
LAMINATE_POISSON = 0.3  # Poisson's ratio of laminates under a pad
SAMPLES, SAMPLES_A_PERIOD = 1000, 100
MOST_PERIODS = 1000  # longest response in periods; pulses of drops are shorter


def expected_deflection(case: "BoardDropCase") -> Deflection:
    """Return the estimated deflection of the board at small rotations.

    The board is a beam between its holes in its first mode, q'' + omega^2 q = 4/pi a(t): w = q sin(pi x/L).
    Width, package and higher modes are neglected.

    Returns:
        Largest deflection [m], largest slope, and angular frequency of the first mode [rad/s].

    Raises:
        PulseError: The table of the pulse cannot be read.
    """
    from reflowshock.fem.loads.shock_pulse import shock_pulse

    length, omega = first_mode(case)
    deflection = first_mode_peak(omega, shock_pulse(case.shock).pulse.integral, longest_duration(case))
    return Deflection(deflection, math.pi / length * deflection, omega)


def board_frequency(case: "BoardDropCase") -> float:
    """Return the estimated first natural frequency of the board at small rotations [Hz]."""
    return first_mode(case)[1] / (math.tau * PERIOD_RATIO)


def expected_duration(case: "BoardDropCase") -> float:
    """Return the expected duration of a shock [s]: the duration of the case, or the time of settling for ``auto``.

    After a pulse of duration t the board swings as if pushed at t / 2: the first peak is at t / 2 + T / 4, and half
    a swing after it is before t + 3 / 4 T. With finite rotations the board also stretches,
    w'' + omega^2 w (1 + c (w/h)^2) = 0, which shortens its period T.

    Raises:
        PulseError: The table of the pulse cannot be read.
    """
    return _expected_end(case, 0.75)


def expected_search(case: "BoardDropCase") -> float:
    """Return the expected duration of the search of a case [s], which adds two swings if the board is damped.

    Raises:
        PulseError: The table of the pulse cannot be read.
    """
    return _expected_end(case, 1.25 if case.shock.damping.acts else 0.75)


def _expected_end(case: "BoardDropCase", periods: float) -> float:
    """Return the end of a shock of automatic duration a number of periods after its pulse [s]."""
    longest, omega = longest_duration(case), first_mode(case)[1]
    if case.shock.duration != "auto":
        return longest
    pulse, period = longest - math.tau / omega, PERIOD_RATIO * math.tau / omega
    if decided(case).shock.numerics.kinematics != "small":
        period *= stretched_period(PERIOD_RATIO * expected_deflection(case).largest / case.board.thickness)
    return min(longest, pulse + periods * period)


def stretched_period(deflection: float) -> float:
    """Return the ratio of the periods of a board that stretches and a board that only bends.

    Both swing with the same energy. The amplitude a [h] of the stretching board solves a^2 + c a^4 / 2 = w^2; the
    square of its frequency grows by 1 + 3/4 c a^2.

    Args:
        deflection: Amplitude w of the board that only bends, over its thickness h.
    """
    square = (math.sqrt(1.0 + 2.0 * STRETCH * deflection**2) - 1.0) / STRETCH
    return 1.0 / math.sqrt(1.0 + 0.75 * STRETCH * square)


def first_mode_peak(omega: float, velocity: Callable[[float], float], duration: float) -> float:
    """Return the largest |q| [m] of q'' + omega^2 q = 4/pi a(t) from rest, by Duhamel's integral.

    Args:
        omega: Angular frequency [rad/s].
        velocity: Function of the time [s] that returns the integral of a from 0 to this time [m/s].
        duration: Duration of the response [s].

    Returns:
        Largest magnitude of the amplitude q [m].
    """
    duration = min(duration, MOST_PERIODS * math.tau / omega)
    count = max(SAMPLES, math.ceil(SAMPLES_A_PERIOD * omega * duration / math.tau))
    ends = np.linspace(0.0, duration, count + 1)
    middle = 0.5 * (ends[1:] + ends[:-1])
    pushes = SHARE * np.diff([velocity(moment) for moment in ends])
    swing = np.sin(omega * middle) * np.cumsum(pushes * np.cos(omega * middle))
    swing -= np.cos(omega * middle) * np.cumsum(pushes * np.sin(omega * middle))
    return float(np.abs(swing).max()) / omega


def expected_peel(case: "BoardDropCase", deflection: Deflection) -> float:
    """Return an estimate of the peel stress of the outermost joints [Pa], under a package much stiffer than the board.

    The joints are an elastic foundation of stiffness k per area between a rigid plate and a board of bending stiffness
    D and curvature K. The gap opens by d with D d^(4) + k d = 0, and d^(2) = K, d^(3) = 0 at the edge of the plate, so
    the pressure is p = k d = K sqrt(k D) there. Each joint is its solder in series with the laminate under both pads,
    a half-space of stiffness E a / (1 - nu^2) under a pad of diameter a.

    Args:
        case: Case of a board drop.
        deflection: Estimate of ``expected_deflection``.
    """
    package, materials = case.package, case.materials
    diameter = 2.0 * min(package.board_pad.wetted_radius, package.package_pad.wetted_radius)
    area = math.pi / 4.0 * diameter**2
    parts = materials.board, materials.substrate, materials.solder
    board, substrate, solder = (material.engineering_constants.young[0] for material in parts)
    springs = (diameter * young / (1.0 - LAMINATE_POISSON**2) for young in (board, substrate))
    compliance = package.standoff / (solder * area) + sum(1.0 / spring for spring in springs)
    curvature = deflection.slope**2 / deflection.largest if deflection.largest > 0.0 else 0.0
    bending = board * case.board.thickness**3 / 12.0
    return curvature * math.sqrt(bending / compliance) * package.pitch / area


def decided(case: "BoardDropCase") -> "BoardDropCase":
    """Return a copy of a case in which ``auto`` settings of the shock have their decided values.

    These are the duration, the damping, the kinematics ("small" or not), and whether the solder yields.

    Raises:
        PulseError: The table of the pulse cannot be read.
    """
    scene, numerics = DropScene(case), case.shock.numerics
    damping = with_estimate(case.shock.damping, scene.frequency)
    update: dict[str, Any] = {"duration": scene.duration, "damping": damping}
    if numerics.kinematics == "auto":
        kinematics, _ = called_for(scene.expected.largest / scene.thickness, scene.cooled)
        update["numerics"] = numerics.model_copy(update={"kinematics": kinematics})
    shock = case.shock.model_copy(update=update)
    return case.model_copy(update={"shock": shock, "materials": scene.decided_materials})


@dataclass(frozen=True)
class DropScene:
    """Case as the ``Drop`` that effects are decided on; its properties raise PulseError for unreadable pulse tables."""

    case: "BoardDropCase"

    @property
    def shock(self) -> "Shock":
        """Parameters of the shock."""
        return self.case.shock

    @property
    def materials(self) -> "Mapping[str, Material]":
        """Materials by role, with the solder that the scene calls for."""
        return self.decided_materials.by_role

    @cached_property
    def decided_materials(self) -> "Materials":
        """Materials; the solder is elastic if it is not expected to yield."""
        materials = self.case.materials
        if materials.solder.plasticity is None or self.yielding["on"]:
            return materials
        return materials.model_copy(update={"solder": materials.solder.elastic})

    @property
    def thickness(self) -> float:
        """Thickness of the board [m]."""
        return self.case.board.thickness

    @property
    def symmetry(self) -> Literal["full", "quarter"]:
        """Symmetry of the model."""
        return self.case.board.symmetry

    @property
    def weight(self) -> Decision:
        """Decision on gravity, from g over the peak acceleration."""
        from reflowshock.fem.loads.shock_pulse import shock_pulse

        return shock_pulse(self.case.shock).gravity

    @property
    def yielding(self) -> Decision:
        """Decision on plastic solder, from the expected peel stress over its yield stress."""
        switch, cooled = self.shock.numerics.plasticity, self.cooled
        stress = expected_peel(self.case, self.expected) if switch == "auto" else 0.0
        return SolderPlasticity.called_for(switch, self.case.materials.by_role, stress, cooled)

    @property
    def cooled(self) -> bool:
        """Whether the shock begins with the residual stress of cooling."""
        return self.case.cooled

    @property
    def duration(self) -> float:
        """Longest duration of the computation [s]."""
        return longest_duration(self.case)

    @cached_property
    def expected(self) -> Deflection:
        """Expected bending of the board by the shock."""
        return expected_deflection(self.case)

    @property
    def frequency(self) -> float:
        """First natural frequency of the board [Hz]."""
        return board_frequency(self.case)

    @property
    def bent_by_weight(self) -> float:
        """Largest deflection of the board by its weight alone [m]."""
        from reflowshock.fem.loads.pulse import STANDARD_GRAVITY

        return first_mode_peak(self.expected.omega, lambda time: STANDARD_GRAVITY * time, self.duration)
