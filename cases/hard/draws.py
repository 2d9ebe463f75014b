"""Hypothesis strategies of random cases: tables of parameters as in a file, within the ranges of their trials."""

from typing import Any

from hypothesis import strategies as st

Table = st.SearchStrategy[dict[str, Any]]


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    """Draw numbers with four digits; numbers below a millionth of the range become zero."""
    least = 1e-6 * (high - low)
    return st.floats(low, high).map(lambda value: float(f"{value:.4g}") if abs(value) > least or low > 0.0 else 0.0)


def powers(low: float, high: float) -> st.SearchStrategy[float]:
    """Draw positive numbers between two powers of ten with four digits."""
    return numbers(low, high).map(lambda exponent: float(f"{10.0**exponent:.4g}"))


def quantities(low: float, high: float, unit: str) -> st.SearchStrategy[str]:
    """Draw quantities as texts with four digits."""
    return numbers(low, high).map(lambda value: f"{value:.4g} {unit}".strip())


def tables(*parts: Table, **values: Any) -> Table:
    """Draw a table that merges all parts with values, each a strategy or a constant."""
    drawn = {name: value if isinstance(value, st.SearchStrategy) else st.just(value) for name, value in values.items()}
    return st.tuples(*parts, st.fixed_dictionaries(drawn)).map(
        lambda tables_of_parts: {name: value for part in tables_of_parts for name, value in part.items()}
    )


KINDS = st.sampled_from(["incompatible_modes", "one_point", "tetrahedron", "tetrahedron_quadratic"])
KINEMATICS = st.sampled_from(["small", "finite"])
BODY = tables(element=KINDS, quality=numbers(0.15, 1.0), cells=st.integers(2, 4), seed=st.integers(0, 10_000))
ELASTIC = tables(BODY, poisson_ratio=numbers(0.0, 0.4999), orthotropy=powers(-2.0, 2.0), aspect=powers(0.0, 1.5))
FLIGHTS = tables(
    ELASTIC,
    contrast=powers(0.0, 5.0),
    foil=st.one_of(st.just("0 um"), quantities(1.0, 100.0, "um")),
    mass_scaled=st.booleans(),
    critical_step=st.sampled_from(["element", "power_iteration"]),
    step_fraction=numbers(0.3, 0.99),
    stiffness_damping=st.sampled_from([0.0, 0.0, 0.01, 0.2]),
    steps=st.integers(500, 3000),
)
IMPACTS = tables(
    element=st.sampled_from(["incompatible_modes", "one_point"]),
    kinematics=KINEMATICS,
    speed=quantities(5.0, 150.0, "m/s"),
    skew=numbers(0.0, 2.0),
    step_fraction=numbers(0.2, 0.9),
    steps=st.integers(50, 400),
)

SCHEMES = ["held_velocity", "impulse", "gravouil_combescure", "local_steps", "local_steps, levels auto"]
LOW = st.just({"height": 1, "thinnest": 1.0})
PAIRS = tables(
    st.one_of(LOW, tables(height=st.integers(2, 3), thinnest=numbers(0.1, 1.0))),
    scheme=st.sampled_from(SCHEMES),
    substeps=st.integers(2, 40),
    impedance=powers(-1.0, 1.0),
    mesh_ratio=numbers(1.0, 8.0),
    shape=st.sampled_from(["flat", "distorted", "curved"]),
    orthotropy=st.one_of(st.just(0.0), powers(0.5, 2.0)),
    step_fraction=numbers(0.4, 0.95),
    layers=st.integers(4, 5),
    columns=st.integers(2, 3),
)
PULSES = tables(
    scheme=st.sampled_from(SCHEMES[:4]),
    substeps=st.integers(2, 15),
    impedance=powers(-1.0, 1.0),
    mesh_ratio=st.integers(1, 4),
    elements=st.integers(20, 40),
)

DROPS = tables(
    bond=numbers(0.0, 5.0),
    gravity="on",
    drop=tables(
        volume=quantities(0.01, 2.0, "mm^3"),
        contact_angle=quantities(15.0, 165.0, "deg"),
        mask_contact_angle="179 deg",
        particles_per_edge=st.integers(5, 7),
    ),
    solder=tables(
        parameters=st.sampled_from(["physical", "paper"]), numerics=tables(time_step_limit=numbers(5.0, 100.0))
    ),
)


@st.composite
def joints(draw: st.DrawFn) -> dict[str, Any]:
    """Draw a joint between pads, filled by 0.8 to 2 times the cylinder between them, offset and tilted."""
    bottom, top, gap = draw(numbers(0.15, 0.3)), draw(numbers(0.15, 0.3)), draw(numbers(0.2, 0.45))
    mean = 0.5 * (bottom + top)
    volume = draw(numbers(0.8, 2.0)) * 3.1416 * mean**2 * gap
    return {
        "joint": {
            "volume": f"{volume:.4g} mm^3",
            "pad_bottom": f"{bottom} mm",
            "pad_top": f"{top} mm",
            "standoff": f"{gap} mm",
            "offset": f"{draw(numbers(0.0, 0.5)) * mean:.4g} mm",
            "tilt": draw(quantities(-8.0, 8.0, "deg")),
            "spacing": "0.06 mm",
        },
        "solder": {"numerics": {"time_step_limit": draw(numbers(5.0, 100.0))}},
    }


@st.composite
def revolved_bodies(draw: st.DrawFn) -> dict[str, Any]:
    """Draw a barrel or hourglass between discs of two radii, shifted by up to half a radius and tilted."""
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


WARPED_JOINTS = tables(
    corner=quantities(-0.1, 0.1, "mm"),
    bulge=quantities(-0.06, 0.12, "mm"),
    lower=quantities(0.16, 0.3, "mm"),
    upper=quantities(0.16, 0.3, "mm"),
    offset=quantities(0.0, 0.1, "mm"),
)
OVERFLOWS = tables(
    shape=tables(
        kind="overflow",
        gap=quantities(0.2, 0.4, "mm"),
        angle=quantities(95.0, 150.0, "deg"),
        reach=quantities(0.28, 0.34, "mm"),
    )
)


@st.composite
def struck_walls(draw: st.DrawFn) -> dict[str, Any]:
    """Draw one or two drops side by side that strike a wall, Weber number 1 to 100, Reynolds number 5 to 500.

    The wall has contact angle hysteresis or not, and the particles are noisy or not.
    """
    diameter, density, tension, weber = 50e-6, 1000.0, 0.07, draw(powers(0.0, 2.0))
    angle, held = draw(numbers(30.0, 150.0)), draw(st.sampled_from([0.0, 0.0, 30.0]))
    time = diameter / (weber * tension / (density * diameter)) ** 0.5
    return {
        "droplet": {
            "diameter": "50 um",
            "density": "1000 kg/m^3",
            "surface_tension": "0.07 N/m",
            "weber": weber,
            "reynolds": draw(powers(0.7, 2.7)),
            "contact_angle": f"{angle} deg",
            "advancing_angle": f"{min(angle + held, 150.0)} deg",
            "receding_angle": f"{max(angle - held, 30.0)} deg",
            "duration": f"{1e6 * time * draw(numbers(0.5, 2.5)):.4g} us",
            "numerics": {"particles_per_diameter": draw(st.integers(8, 10))},
        },
        "pair": draw(st.sampled_from(["none", "none", "beside"])),
        "unrest": {"displaced": draw(numbers(0.0, 0.2)), "density": draw(numbers(0.0, 0.01))},
    }


DRAWS: dict[str, Table] = {
    "patches": tables(ELASTIC, kinematics=KINEMATICS),
    "flights": FLIGHTS,
    "impacts": IMPACTS,
    "tensions": tables(BODY, plastic_strain=powers(-4.0, -0.5), steps=st.integers(1, 50)),
    "pairs": PAIRS,
    "free_pairs": tables(PAIRS, free=True, windows=st.integers(400, 1000)),
    "ties": tables(PAIRS, offset=quantities(-1.0, 1.0, "nm")),
    "pulses": PULSES,
    "drops": DROPS,
    "joints": joints(),
    "revolved_bodies": revolved_bodies(),
    "warped_joints": WARPED_JOINTS,
    "overflows": OVERFLOWS,
    "struck_walls": struck_walls(),
}
