"""Single joint at rest: its package is fixed, floats, or follows a path."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.effects import Decision, decide_effects, reference_weight
from reflowshock.particles.parameters.scenes import FloatingPackage, Joint
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.plate_motion import LIFT, SHIFT, TURN, Floating
from reflowshock.particles.reference.young_laplace import Meridian
from reflowshock.particles.scenes.metrics import Metrics, with_shape_error
from reflowshock.particles.scenes.moving_joint import follow_path, settle_joint
from reflowshock.particles.scenes.reference_shapes import reference_meridian
from reflowshock.particles.scenes.reflow import solve_joint
from reflowshock.particles.steps.shape import JointShape

DIRECTIONS = {"lift": LIFT, "shift": SHIFT, "turn": TURN}
BRACKET = 0.2  # relative half-width of the interval around the computed collapse height that contains the exact one
KNOTS = 40  # number of standoffs of the exact pull, which is interpolated linearly
ERRORS = ("width_error", "waist_error", "axial_force_error")
ROW_METRICS = ("max_width", "waist", "axial_force", *ERRORS)


@dataclass(frozen=True, slots=True)
class JointAtRest:
    """Joint at rest.

    Attributes:
        shape: Shape at the final position of the package.
        effects: Decision on each effect.
        reference: Exact meridian at the final position; None if the joint has none.
        path_rows: Position of the package and metrics of the joint (SI values) at the start and at each target of a
            path; empty without a path.
    """

    shape: JointShape
    effects: Mapping[str, Decision]
    reference: Meridian | None
    path_rows: list[dict]


def joint_to_rest(
    joint: Joint,
    solder: Solder,
    progress: Callable[[float], None] | None = None,
    checkpoints: Callable[[int], Checkpoint] | None = None,
) -> JointAtRest:
    """Compute the solder of a joint, and a floating package, at rest.

    Args:
        joint: Scene of the joint: volume, pads, package and resolution.
        solder: Fluid and process, with the volume of the joint.
        progress: Function called with the fraction done, 0 to 1.
        checkpoints: Function of the number of a target of the path that returns its checkpoint; joints without a path
            use number 0.

    Returns:
        Final shape with history and metrics, decisions on the effects, exact meridian (None without one), and the
        position and metrics at each target of a path.

    Raises:
        TooLittleSolder: The volume does not span the gap.
        NotAtRest: The joint is not at rest after ``solder.numerics.max_steps``.
        SolveFailed: A linear solve failed.
    """
    effects = decide_effects(joint.geometry, solder)
    weight = reference_weight(solder, effects)
    if joint.path is not None:
        shapes = _along(joint, solder, progress, checkpoints)
        geometries = [joint.geometry, *joint.path_geometries][: len(shapes)]
        references = [reference_meridian(geometry, solder, weight) for geometry in geometries]
        path_rows = [_path_row(*state) for state in zip(geometries, shapes, references, strict=True)]
        shape = replace(shapes[-1], metrics=shapes[-1].metrics | _worst(shapes))
        if joint.path.speed is None:
            states = [shape.snapshots[-1] for shape in shapes[:-1]] or shapes[0].snapshots
            shape = replace(shape, snapshots=states)
        else:
            shape = _with_exact_pull(shape, joint, solder, weight)
        return JointAtRest(with_shape_error(shape, solder, references[-1]), effects, references[-1], path_rows)
    first = None if checkpoints is None else checkpoints(0)
    if joint.package is None:
        shape = solve_joint(joint.geometry, solder, progress, checkpoint=first)
        reference = reference_meridian(joint.geometry, solder, weight)
        return JointAtRest(with_shape_error(shape, solder, reference), effects, reference, [])
    shape = settle_joint(joint.geometry, solder, (floating(joint.package),), progress, first)
    balance = _balance(joint, solder, weight, shape)
    end = joint.geometry_at(shape.metrics["standoff"][0], 0.0, 0.0)
    reference = reference_meridian(end, solder, weight) if "collapse_height_error" in balance else None
    shape = replace(shape, metrics=shape.metrics | balance)
    return JointAtRest(with_shape_error(shape, solder, reference), effects, reference, [])


def floating(package: FloatingPackage) -> Floating:
    """Return the motion of a floating package: plate 1 of the joint under a load [N], with its free directions.

    Args:
        package: Package with the force that presses it down [N] and the names of its free directions (lift, shift,
            turn).
    """
    free = np.vstack([DIRECTIONS[name] for name in package.free])
    return Floating(1, free, np.array([0.0, 0.0, -package.load]))


def _along(
    joint: Joint,
    solder: Solder,
    progress: Callable[[float], None] | None,
    checkpoints: Callable[[int], Checkpoint] | None,
) -> list[JointShape]:
    """Return the joint at rest at the start and after each step of the path, until the neck breaks."""
    shapes = []
    speed = joint.path.speed if joint.path else None
    for shape in follow_path(joint.geometry, solder, joint.path_geometries, checkpoints, speed):
        shapes.append(shape)
        if progress is not None:
            progress(len(shapes) / (1 + len(joint.path_geometries)))
    return shapes


def _with_exact_pull(shape: JointShape, joint: Joint, solder: Solder, weight: float | None) -> JointShape:
    """Add ``pull_exact`` [N] to the history: the Young-Laplace force of a vertical path, NaN for other paths."""
    if "standoff" not in shape.history:
        return shape
    standoff, direction = shape.history["standoff"], np.sign(joint.path_geometries[-1].gap - joint.standoff)
    pull = np.full_like(standoff, np.nan)
    if direction:
        knots = np.linspace(standoff.min(), standoff.max(), KNOTS)
        meridians = [reference_meridian(replace(joint.geometry, gap=gap), solder, weight) for gap in knots]
        pulls = [np.nan if meridian is None else -direction * meridian.axial_force for meridian in meridians]
        pull = np.interp(standoff, knots, pulls)
    return replace(shape, history=shape.history | {"pull_exact": pull})


def _balance(joint: Joint, solder: Solder, weight: float | None, shape: JointShape) -> Metrics:
    """Return the errors of a package that floats freely in height.

    The axial force is compared with the load, over pi gamma times the smaller pad radius, and the height with the
    Young-Laplace joint.
    """
    package = joint.package
    if package is None or "lift" not in package.free:
        return {}
    scale = np.pi * solder.surface_tension * min(joint.pad_bottom, joint.pad_top)
    error = (shape.metrics["axial_force"][0] - package.load) / scale
    balance: Metrics = {"load": (package.load, "N"), "force_balance_error": (error, "")}
    if np.isfinite(shape.metrics["width_error"][0]):
        exact = collapse_height(joint, solder, weight, shape.metrics["standoff"][0])
        balance["collapse_height_error"] = (shape.metrics["standoff"][0] / exact - 1.0, "")
    return balance


def collapse_height(joint: Joint, solder: Solder, weight: float | None, near: float) -> float:
    """Return the standoff at which the Young-Laplace joint carries the load of the package [m].

    Args:
        joint: Volume, pads and package.
        solder: Fluid properties.
        weight: Specific weight rho g [N/m^3]; None if the shape is not axisymmetric.
        near: Guess of the standoff [m].

    Returns:
        Standoff [m]; NaN if no solution is within 20 % of the guess.
    """
    load = joint.package.load if joint.package else 0.0

    def excess(standoff: float) -> float:
        meridian = reference_meridian(joint.geometry_at(standoff, 0.0, 0.0), solder, weight)
        return float("nan") if meridian is None else meridian.axial_force - load

    low, high = (1.0 - BRACKET) * near, (1.0 + BRACKET) * near
    if not excess(low) * excess(high) < 0.0:
        return float("nan")
    return float(brentq(excess, low, high, rtol=1e-6))


def _path_row(geometry: JointGeometry, shape: JointShape, reference: Meridian | None) -> dict:
    """Return the position of the package, verdict, main metrics and exact force in SI units; None for NaN values."""
    values = {name: _value(shape, name) for name in ROW_METRICS}
    exact = {"axial_force_exact": float("nan") if reference is None else reference.axial_force}
    finite = {name: value if np.isfinite(value) else None for name, value in (values | exact).items()}
    position = {"standoff": geometry.gap, "offset": geometry.offset[0], "tilt": geometry.tilt[1]}
    return position | {"verdict": shape.verdict} | finite


def _value(shape: JointShape, name: str) -> float:
    """Return the value of a metric; NaN if the shape lacks it, as a broken joint has no waist."""
    return shape.metrics.get(name, (float("nan"), ""))[0]


def _worst(shapes: Sequence[JointShape]) -> Metrics:
    """Return the largest errors of all positions with a reference, and the number of positions reached."""
    worst: Metrics = {"places": (float(len(shapes)), "")}
    for name in ERRORS:
        errors = [value for shape in shapes if np.isfinite(value := _value(shape, name))]
        worst[name] = (max(errors, key=abs, default=float("nan")), "")
    return worst
