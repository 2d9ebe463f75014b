"""Random scenes of molten solder: drops and joints within what the case file allows."""

from typing import Any

from hypothesis import strategies as st

from reflowshock.workflow.stress_test.random_trial import RandomTrial, numbers, quantities

CONSERVED = {"volume_drift": "1e-6", "energy_rise": "1e-4"}


@st.composite
def drops(draw: st.DrawFn) -> dict[str, Any]:
    """A drop on a wall under some gravity."""
    return {
        "bond": draw(numbers(0.0, 5.0)),
        "gravity": "on",
        "drop": {
            "volume": draw(quantities(0.01, 2.0, "mm^3")),
            "contact_angle": draw(quantities(15.0, 165.0, "deg")),
            "mask_contact_angle": "179 deg",
            "particles_per_edge": draw(st.integers(5, 7)),
        },
        "solder": {
            "parameters": draw(st.sampled_from(["physical", "paper"])),
            "numerics": {"time_step_limit": draw(numbers(5.0, 100.0))},
        },
    }


@st.composite
def joints(draw: st.DrawFn) -> dict[str, Any]:
    """A joint between pads of some sizes, filled by 0.6 to 2 times the cylinder between them, offset and tilted."""
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


RANDOM = [
    RandomTrial(
        name="reflow_random_drops",
        title="random drops: volume, contact angle, Bond number, liquid, resolution, time step",
        why="Volume is kept, the energy falls in every step, and the shape is that of Young and Laplace.",
        trial="drop",
        tables=drops(),
        bounds=CONSERVED | {"height_error": "5 %", "max_width_error": "5 %"},
    ),
    RandomTrial(
        name="reflow_random_joints",
        title="random joints: pads, gap, fill, offset, tilt, time step",
        why="Volume is kept, the energy falls in every step, and the solder comes to rest or the neck opens.",
        trial="joint",
        tables=joints(),
        bounds=CONSERVED,
        share=2,
    ),
]
