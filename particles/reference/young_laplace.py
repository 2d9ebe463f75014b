"""Young-Laplace meridians: independent reference solutions for joints and sessile drops (scipy only).

Axisymmetric surface at rest, with the arc length s and the angle psi of the meridian to the outward radius:
    r' = cos psi,  z' = sin psi,  psi' = (p - w z) / gamma - sin(psi) / r,  V' = pi r^2 sin psi,
with the pressure p at z = 0 and the specific weight w = rho g. In a plane, the term sin(psi) / r vanishes and
A' = 2 r sin psi.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from reflowshock.arrays import Floats

TOLERANCE = 1e-8
SAMPLES = 401
SMALLEST_RADIUS = 1e-3


class NoMeridian(ValueError):
    """Error for parameters without a smooth equilibrium meridian, or whose meridian was not found."""


@dataclass(frozen=True, slots=True)
class Meridian:
    """Equilibrium meridian, from the board upwards.

    Attributes:
        r: Radii, shape (k,) [m].
        z: Heights, shape (k,) [m].
        pressure: Pressure above ambient at z = 0 [Pa].
        axial_force: Force of the liquid on the package along +z [N]; positive pushes the plates apart.
        angle_board: Contact angle at the board, measured inside the liquid [rad].
        angle_package: Contact angle at the package [rad]; nan for a drop.
    """

    r: Floats
    z: Floats
    pressure: float
    axial_force: float
    angle_board: float
    angle_package: float

    @property
    def max_width(self) -> float:
        """Largest diameter [m]."""
        return 2.0 * float(self.r.max())

    @property
    def waist(self) -> float:
        """Smallest diameter [m]."""
        return 2.0 * float(self.r.min())

    @property
    def height(self) -> float:
        """Height [m]."""
        return float(np.ptp(self.z))


def joint_meridian(  # noqa: PLR0913 - six physical numbers define a joint
    volume: float,
    radius_board: float,
    radius_package: float,
    gap: float,
    surface_tension: float,
    weight: float = 0.0,
    *,
    angle_limits: tuple[float, float] = (0.0, 2.0 * np.pi),
) -> Meridian:
    """Compute the meridian of a joint that is pinned at the edges of both discs.

    Args:
        volume: Volume [m^3].
        radius_board: Radius of the lower disc [m].
        radius_package: Radius of the upper disc [m].
        gap: Distance between the discs [m].
        surface_tension: Surface tension gamma [N/m].
        weight: Specific weight rho g [N/m^3].
        angle_limits: Contact angles of pad and mask [rad]. An end whose angle would exceed a limit leaves its edge and
            takes the limit as contact angle (Gibbs). By default, both ends stay pinned.

    Returns:
        Radii and heights of the meridian [m], pressure at z = 0 [Pa], axial force on the package [N] and contact angles
        [rad].

    Raises:
        NoMeridian: The boundary value problem has no solution near the family of smooth barrels.
    """
    a, b, target = radius_board / gap, radius_package / gap, volume / gap**3
    bond = weight * gap**2 / surface_tension
    board, package = _End(radius=a), _End(radius=b)
    state = _barrel(a, b, target)
    while True:
        state = _solve_joint_meridian(state, (board, package), target, bond)
        angles = float(np.pi - state.y[2, 0]), float(state.y[2, -1])
        released = board.released(angles[0], angle_limits), package.released(angles[1], angle_limits)
        if released == (board, package):
            break
        board, package = released
    y = state.sample(np.linspace(0.0, 1.0, SAMPLES))
    r, z, psi = y[0] * gap, y[1] * gap, y[2]
    pressure = state.unknown[1] * surface_tension / gap
    top = r[-1]
    force = np.pi * top**2 * (pressure - weight * gap) - 2.0 * np.pi * top * surface_tension * np.sin(psi[-1])
    return Meridian(r, z, float(pressure), float(force), *angles)


@dataclass(frozen=True, slots=True)
class _End:
    """Condition at one end of the meridian: a radius (in gaps), or a contact angle [rad]."""

    radius: float = float("nan")
    angle: float = float("nan")

    def residual(self, radius: float, angle: float) -> float:
        return radius - self.radius if np.isfinite(self.radius) else angle - self.angle

    def released(self, angle: float, limits: tuple[float, float]) -> "_End":
        """Return this end, or a sliding end with the limit that the angle exceeds."""
        allowed = min(max(angle, limits[0]), limits[1])
        return self if allowed == angle or np.isfinite(self.angle) else _End(angle=allowed)


@dataclass(frozen=True, slots=True)
class _State:
    """Nodes, states (r, z, psi, V) at the nodes, and unknowns (length of the meridian, pressure), scaled by the gap.

    ``sample`` interpolates the states.
    """

    s: Floats
    y: Floats
    unknown: Floats
    sample: Callable[[Floats], Floats]


def _solve_joint_meridian(guess: _State, ends: tuple[_End, _End], target: float, bond: float) -> _State:
    """Solve the boundary value problem: two ends, the gap, and the volume fix the length and the pressure."""
    from scipy.integrate import solve_bvp  # imported late to keep the start-up of plans fast

    def slopes(_: Floats, y: Floats, unknown: Floats) -> Floats:
        length, pressure = unknown
        r, z, psi = np.maximum(y[0], SMALLEST_RADIUS), y[1], y[2]
        turning = pressure - bond * z - np.sin(psi) / r
        return length * np.stack((np.cos(psi), np.sin(psi), turning, np.pi * r**2 * np.sin(psi)))

    def conditions(low: Floats, high: Floats, _: Floats) -> Floats:
        board = ends[0].residual(low[0], np.pi - low[2])
        package = ends[1].residual(high[0], high[2])
        return np.array([board, low[1], low[3], package, high[1] - 1.0, high[3] - target])

    with np.errstate(all="ignore"):  # without an equilibrium, the iterates diverge before the solver stops
        solution = solve_bvp(slopes, conditions, guess.s, guess.y, p=guess.unknown, tol=TOLERANCE, max_nodes=20000)
    if not solution.success or solution.y[0].min() <= SMALLEST_RADIUS:
        raise NoMeridian(
            f"no equilibrium joint of volume {target:.4g} and ends {ends} (in gaps): {solution.message.lower()}"
        )
    return _State(solution.x, solution.y, solution.p, solution.sol)


def _barrel(a: float, b: float, target: float) -> _State:
    """Return a parabolic barrel of the required volume as initial guess."""
    z = np.linspace(0.0, 1.0, 101)
    rim, hump = a + (b - a) * z, 4.0 * z * (1.0 - z)

    # The mean of (rim + bulge hump)^2 is target / pi; the means of rim^2, rim hump, hump^2 are known.
    square, product, hump_square = (a * a + a * b + b * b) / 3.0, (a + b) / 3.0, 8.0 / 15.0
    discriminant = product**2 - hump_square * (square - target / np.pi)
    bulge = (np.sqrt(max(discriminant, 0.0)) - product) / hump_square
    r = np.maximum(rim + bulge * hump, 0.02)
    arc = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(r), np.diff(z)))))
    psi = np.unwrap(np.arctan2(np.gradient(z, arc), np.gradient(r, arc)))
    volume = np.concatenate(([0.0], np.cumsum(0.5 * np.pi * (r[1:] ** 2 + r[:-1] ** 2) * np.diff(z))))
    middle = len(z) // 2
    curvature = 8.0 * bulge / (1.0 + (b - a) ** 2) ** 1.5 + 1.0 / r[middle]
    return _State(arc / arc[-1], np.stack((r, z, psi, volume)), np.array([arc[-1], curvature]), np.asarray)


@dataclass(frozen=True, slots=True)
class _Fluid:
    """Surface tension [N/m] and specific weight [N/m^3]."""

    surface_tension: float
    weight: float


def sessile_meridian(volume: float, contact_angle: float, surface_tension: float, weight: float = 0.0) -> Meridian:
    """Compute the meridian of a drop on a uniform wall (Bashforth & Adams), from the wall to the apex.

    Args:
        volume: Volume [m^3].
        contact_angle: Contact angle [rad], in (0, pi).
        surface_tension: Surface tension gamma [N/m].
        weight: Specific weight rho g [N/m^3].

    Returns:
        Radii and heights of the meridian [m], pressure at z = 0 [Pa], axial force [N] and contact angle [rad].
    """
    cap = np.cbrt(np.pi / 3.0 * (1.0 - np.cos(contact_angle)) ** 2 * (2.0 + np.cos(contact_angle)))
    return _sessile(np.cbrt(volume), cap, contact_angle, _Fluid(surface_tension, weight), is_plane=False)


def sessile_section(area: float, contact_angle: float, surface_tension: float, weight: float = 0.0) -> Meridian:
    """Compute half of the cross-section of a plane drop on a uniform wall; r is the distance from the middle.

    Without weight it is a segment of a circle.

    Args:
        area: Area of the whole section [m^2].
        contact_angle: Contact angle [rad], in (0, pi).
        surface_tension: Surface tension gamma [N/m].
        weight: Specific weight rho g [N/m^3].

    Returns:
        Distances from the middle and heights of the curve [m], pressure at z = 0 [Pa] and contact angle [rad].
    """
    segment = np.sqrt(contact_angle - np.sin(contact_angle) * np.cos(contact_angle))
    return _sessile(np.sqrt(area), segment, contact_angle, _Fluid(surface_tension, weight), is_plane=True)


def _sessile(length: float, weightless: float, contact_angle: float, fluid: _Fluid, *, is_plane: bool) -> Meridian:
    """Shoot from the apex until the profile has turned by the contact angle; find the apex curvature from the size.

    Args:
        length: Edge of a cube of equal volume, or of a square of equal area [m].
        weightless: Apex curvature without weight, times ``length``.
        contact_angle: Contact angle [rad].
        fluid: Surface tension and weight.
        is_plane: Whether the drop is plane instead of axisymmetric.
    """
    from scipy.optimize import brentq

    bond = fluid.weight * length**2 / fluid.surface_tension

    def shoot(curvature: float) -> Floats:
        return _from_apex(curvature, bond, contact_angle, is_plane)

    def excess(logarithm: float) -> float:
        return float(shoot(np.exp(logarithm))[2, -1] - 1.0)

    middle = np.log(weightless)
    curvature = np.exp(brentq(excess, middle - 6.0, middle + 2.0, xtol=1e-13))
    r, depth, _ = shoot(curvature)
    height = depth[-1]
    at_apex = curvature if is_plane else 2.0 * curvature
    pressure = (at_apex + bond * height) * fluid.surface_tension / length
    return Meridian(
        r[::-1] * length, (height - depth[::-1]) * length, float(pressure), 0.0, contact_angle, float("nan")
    )


def sphere_meridian(volume: float, surface_tension: float) -> Meridian:
    """Return the meridian of a free drop centred at the origin, a half circle.

    Args:
        volume: Volume [m^3].
        surface_tension: Surface tension gamma [N/m].

    Returns:
        Radii and heights of the meridian [m], and the pressure in the drop [Pa].
    """
    radius, psi = float(np.cbrt(3.0 * volume / (4.0 * np.pi))), np.linspace(0.0, np.pi, SAMPLES)
    pressure = 2.0 * surface_tension / radius
    return Meridian(radius * np.sin(psi), -radius * np.cos(psi), pressure, 0.0, float("nan"), float("nan"))


def cap_angle(volume: float, radius: float) -> float:
    """Return the contact angle [rad] of a spherical cap of a volume [m^3] on a disc of a radius [m]."""
    half, cube = 3.0 * volume / np.pi, radius**3  # the height h solves h^3 + 3 r^2 h = 2 half
    root = np.hypot(half, cube)
    height = np.cbrt(half + root) + np.cbrt(half - root)
    return float(2.0 * np.arctan2(height, radius))


def pad_meridian(
    volume: float,
    pad_radius: float,
    surface_tension: float,
    weight: float = 0.0,
    *,
    angle_limits: tuple[float, float],
) -> Meridian:
    """Compute the meridian of a drop on a round pad in a solder mask, pinned at the edge by Gibbs' condition.

    A base inside the pad has the contact angle of the pad, a base on the mask has the angle of the mask; between these
    angles the contact line is pinned at the edge.

    Args:
        volume: Volume [m^3].
        pad_radius: Radius of the pad [m], infinite for a uniform wall.
        surface_tension: Surface tension gamma [N/m].
        weight: Specific weight rho g [N/m^3].
        angle_limits: Contact angles of pad and mask [rad].

    Returns:
        Radii and heights of the meridian [m], pressure at z = 0 [Pa], axial force [N] and contact angle [rad].
    """
    from scipy.optimize import brentq

    def drop(angle: float) -> Meridian:
        return sessile_meridian(volume, angle, surface_tension, weight)

    def overhang(angle: float) -> float:
        return float(drop(angle).r[0]) - pad_radius

    if overhang(angle_limits[0]) <= 0.0:
        return drop(angle_limits[0])
    if overhang(angle_limits[1]) >= 0.0:
        return drop(angle_limits[1])
    return drop(brentq(overhang, *angle_limits, xtol=1e-10))


def _from_apex(curvature: float, bond: float, contact_angle: float, is_plane: bool) -> Floats:
    """Integrate radius, depth below the apex and volume along the meridian, shape (3, k), scaled by V^(1/3).

    In a plane: half width, depth and area, scaled by the square root of the area.
    """
    from scipy.integrate import solve_ivp

    def slopes(_: float, y: Floats) -> list[float]:
        r, depth, psi, _volume = y
        if is_plane:
            return [np.cos(psi), np.sin(psi), curvature + bond * depth, 2.0 * r * np.sin(psi)]
        ratio = np.sin(psi) / r if r > 1e-9 else curvature
        turning = 2.0 * curvature + bond * depth - ratio
        return [np.cos(psi), np.sin(psi), turning, np.pi * r * r * np.sin(psi)]

    def reached(_: float, y: Floats) -> float:
        return float(y[2] - contact_angle)

    reached.terminal = True  # type: ignore[attr-defined]
    end = 4.0 * np.pi / curvature
    apex, accuracy = [0.0, 0.0, 0.0, 0.0], {"rtol": 1e-10, "atol": 1e-12}
    path = solve_ivp(slopes, (0.0, end), apex, events=reached, dense_output=True, **accuracy)
    y = path.sol(np.linspace(0.0, path.t[-1], SAMPLES))
    return np.stack((y[0], y[1], y[3]))
