"""Random bodies to be meshed: barrels and hourglasses that lean, flat or warped above, voids, overflowing solder."""

from typing import Any

from hypothesis import strategies as st

from reflowshock.workflow.stress_test.random_trial import RandomTrial, numbers, quantities

GOOD = {
    "volume_error": "0.3 %",
    "standoff_error": "0.3 %",
    "contact_area_error": "0.3 %",
    "scaled_jacobian": "> 0.2",
    "head_error": "1 um",
}


@st.composite
def revolved(draw: st.DrawFn) -> dict[str, Any]:
    """A barrel or hourglass between discs of two radii, shifted by up to half a radius and tilted."""
    lower, upper = draw(numbers(0.16, 0.3)), draw(numbers(0.16, 0.3))
    least = min(lower, upper)
    return {
        "shape": {
            "kind": "barrel",
            "gap": draw(quantities(0.15, 0.5, "mm")),
            "bulge": f"{draw(numbers(-0.5, 0.6)) * least:.4g} mm",
            "lower": f"{lower} mm",
            "upper": f"{upper} mm",
        },
        "offset": f"{draw(numbers(0.0, 0.5)) * least:.4g} mm",
        "tilt": draw(quantities(-8.0, 8.0, "deg")),
        "numerics": {"layers": draw(st.integers(4, 12)), "core": draw(st.integers(1, 3))},
    }


@st.composite
def warped(draw: st.DrawFn) -> dict[str, Any]:
    """A joint under a package whose corner is lifted or pulled down by up to a third of the gap."""
    return {
        "corner": draw(quantities(-0.1, 0.1, "mm")),
        "bulge": draw(quantities(-0.06, 0.12, "mm")),
        "lower": draw(quantities(0.16, 0.3, "mm")),
        "upper": draw(quantities(0.16, 0.3, "mm")),
        "offset": draw(quantities(0.0, 0.1, "mm")),
    }


@st.composite
def overflowing(draw: st.DrawFn) -> dict[str, Any]:
    """Solder on the mask at 95 to 150 degrees."""
    return {
        "shape": {
            "kind": "overflow",
            "gap": draw(quantities(0.2, 0.4, "mm")),
            "angle": draw(quantities(95.0, 150.0, "deg")),
            "reach": draw(quantities(0.28, 0.34, "mm")),
        }
    }


WHY = "Volume, standoff and wetted areas are those of the body, no hexahedron is flat or inverted; else it is refused."
RANDOM = [
    RandomTrial(
        name="remesh_random_bodies",
        title="random barrels and hourglasses: gap, bulge, discs, shift, tilt, layers, core",
        why=WHY,
        trial="body",
        tables=revolved(),
        bounds=GOOD,
        share=3,
    ),
    RandomTrial(
        name="remesh_random_warped",
        title="random joints under a warped package",
        why=WHY,
        trial="warped_joint",
        tables=warped(),
        bounds=GOOD | {"volume_error": "1e-9"},
        share=2,
    ),
    RandomTrial(
        name="remesh_random_overflow",
        title="random solder on the mask: gap, angle, reach",
        why=WHY,
        trial="body",
        tables=overflowing(),
        bounds=GOOD,
    ),
]
