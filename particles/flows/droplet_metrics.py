"""Metrics of a droplet: its size on a wall, its state at rest, and the outcome of an impact."""

from collections.abc import Mapping
from math import pi, sqrt

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.flows.droplet import Droplet, cap
from reflowshock.particles.flows.flow_effects import decide_flow
from reflowshock.particles.flows.result import Metrics
from reflowshock.particles.reference.impact_spread import of_measured, wildeman

# Range of the profile that is fitted: from this many spacings above the wall, where the profile is rounded, to this
# fraction of the height.
FOOT, SHOULDER = 1.5, 0.7
FEWEST = 12
# Residual film thickness of an impact over the diameter, times Re^(2/5) (Roisman 2009).
RESIDUAL_FILM = 0.79


def impact_texts(scene: Droplet, history: Mapping[str, Floats]) -> dict[str, str]:
    """Describe an impact in words.

    Args:
        scene: Parameters of the droplet: liquid, size, wall, speed, effects and numerics.
        history: Samples over time; ``foot`` (wetted diameter [m]), ``parts`` (number) and ``shed`` (number of
            detachments so far) are used, each of shape (n,).

    Returns:
        Texts ``outcome``, ``film`` (its thickness) and, where correlations are valid, ``spread_expected``.
    """
    return {"outcome": outcome(history), "film": _film_text(scene)} | _expected_texts(scene)


def _film_text(scene: Droplet) -> str:
    """Describe the film thickness of an impact and the resolution that it requires."""
    film = RESIDUAL_FILM / scene.reynolds_number**0.4
    return f"{film:.2g} D thick; {2.0 / film:.0f} particles a diameter put two across it"


def _expected_texts(scene: Droplet) -> dict[str, str]:
    """Describe the spread predicted by correlations; empty if no correlation applies."""
    numbers = scene.weber_number, scene.reynolds_number, scene.advancing
    if not (between := of_measured(*numbers)):
        return {}
    measured = f"{between[0]:.2f} to {between[1]:.2f} D by correlations of measured drops"
    return {"spread_expected": f"{measured}, {wildeman(*numbers):.2f} D by a correlation of computed drops"}


def drop_height(scene: Droplet, points: Floats) -> float:
    """Return the height of a drop above the wall, or the extent of a free drop along z [m].

    Args:
        scene: Parameters of the droplet: liquid, size, wall, speed, effects and numerics.
        points: Vertices of the surface, shape (m, 3) [m].
    """
    return float(points[:, 2].max() if scene.has_wall else np.ptp(points[:, 2]))


def base_width(points: Floats, spacing: float) -> float:
    """Return the base diameter of a drop [m], extrapolated to the wall; nan if the profile has too few points.

    The squared radius of a spherical cap is a parabola in height, which is fitted to the profile.

    Args:
        points: Vertices of the surface, shape (m, 3) [m].
        spacing: Spacing of the particles [m].
    """
    height = points[:, 2]
    read = (height > FOOT * spacing) & (height < SHOULDER * height.max())
    if read.sum() < FEWEST:
        return float("nan")
    offset = points[:, :2] - points[:, :2].mean(axis=0)
    at_wall = float(np.polynomial.Polynomial.fit(height[read], (offset[read] ** 2).sum(axis=1), 2)(0.0))
    return 2.0 * sqrt(max(at_wall, 0.0))


def outcome(history: Mapping[str, Floats]) -> str:
    """Return the outcome of an impact in words, e.g. "stays on the wall" or "rebounds, sheds satellites".

    Args:
        history: Samples over time, shape (n,): ``foot`` (wetted diameter, 0 off the wall), ``parts`` (number of parts)
            and ``shed`` (number of detachments so far).
    """
    wets, in_parts = history["foot"] > 0.0, history["parts"][-1] > 1.0
    if not wets.any():
        return "does not touch the wall"
    if wets[-1]:
        text = "a part rebounds" if in_parts else "stays on the wall"
    else:
        text = "rebounds in parts" if in_parts else "rebounds"
    return f"{text}, sheds satellites" if history["shed"][-1] else text


def rest_metrics(scene: Droplet) -> tuple[str, ...]:
    """Return the names of the metrics with an exact value at rest, for a free sphere or a weightless spherical cap.

    They are pressure and roundness of a free drop, base and height on a wall; empty for a drop with weight, an impact,
    or a bounded scene.

    Args:
        scene: Parameters of the droplet, of which wall, weight, speed and hysteresis decide.
    """
    if not scene.has_wall:
        return ("pressure_error", "roundness")
    weighs = decide_flow(scene)["droplet_gravity"]["on"]
    return () if weighs or scene.impact_speed or scene.bounds else ("base_error", "height_error")


def droplet_metrics(scene: Droplet, history: dict[str, Floats]) -> Metrics:
    """Compute the metrics of a droplet; values at rest are means over the last tenth of the simulated time.

    ``surface_volume_drift`` is the largest change of the enclosed volume, with the spray, at any sample: mesh
    smoothing, every few steps, resets it to the volume of the particles. ``parts_shed`` counts events in which one or
    more parts detach.

    Args:
        scene: Parameters of the droplet: liquid, size, wall, speed, effects and numerics.
        history: Samples over time, shape (n,), in the columns of a droplet's run.

    Returns:
        Metric name -> (value, unit): always drift, spray and Capillary and Ohnesorge numbers; pressure and roundness of
        a free drop, or base and height over the diameter on a wall; for impacts also spread, film and contact time.
    """
    late = history["time"] >= 0.9 * history["time"][-1]
    mean = {name: float(column[late].mean()) for name, column in history.items()}
    fastest = float(history["largest_speed"][late].max())
    change = history["surface_volume"] / history["surface_volume"][0] - 1.0
    metrics: Metrics = {
        "capillary_number": (fastest * scene.liquid_viscosity / scene.surface_tension, ""),
        "surface_volume_drift": (float(change[np.abs(change).argmax()]), ""),
        "spray_share": (float(history["spray"].max()), ""),
        "parts_shed": (float(history["shed"][-1]), ""),
        "ohnesorge": (scene.ohnesorge, ""),
    }
    if not scene.has_wall:
        metrics["mean_pressure"] = (mean["mean_pressure"], "Pa")
        metrics["pressure_error"] = (mean["mean_pressure"] / scene.laplace_pressure - 1.0, "")
        metrics["roundness"] = (mean["roundness"], "")
        return metrics
    base, height = cap(scene.angle)
    metrics["base_over_diameter"], metrics["height_over_diameter"] = (mean["base"], ""), (mean["height"], "")
    if rest_metrics(scene):
        metrics["base_error"] = (mean["base"] / base - 1.0, "")
        metrics["height_error"] = (mean["height"] / height - 1.0, "")
    if scene.impact_speed:
        widest = int(np.argmax(history["spread"]))
        metrics["weber"], metrics["reynolds"] = (scene.weber_number, ""), (scene.reynolds_number, "")
        metrics["spread_max"] = (float(history["spread"][widest]), "")
        metrics["time_of_spread_max"] = (float(history["time"][widest]), "s")
        if history["foot"][widest] > 0.0:
            film = scene.volume / (0.25 * pi * (history["foot"][widest] * scene.diameter) ** 2)
            metrics["film_over_spacing"] = (float(film / scene.spacing), "")
        wets = np.flatnonzero(history["foot"] > 0.0)
        if len(wets) and wets[-1] + 1 < len(history["time"]):
            metrics["contact_time"] = (float(history["time"][wets[-1] + 1] - history["time"][wets[0]]), "s")
    return metrics
