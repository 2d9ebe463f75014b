"""Random pairs of coupled models: scheme, step ratio, impedance, mesh ratio, shape, layers, within what is allowed."""

from typing import Any

from hypothesis import strategies as st

from reflowshock.workflow.stress_test.random_elements import powers
from reflowshock.workflow.stress_test.random_trial import RandomTrial, numbers, quantities

SCHEMES = ["held_velocity", "impulse", "gravouil_combescure", "local_steps", "local_steps, levels auto"]


@st.composite
def pairs(draw: st.DrawFn) -> dict[str, Any]:
    """A board and a block on it."""
    height = draw(st.integers(1, 3))
    return {
        "scheme": draw(st.sampled_from(SCHEMES)),
        "substeps": draw(st.integers(2, 40)),
        "impedance": draw(powers(-1.0, 1.0)),
        "mesh_ratio": draw(numbers(1.0, 8.0)),
        "shape": draw(st.sampled_from(["flat", "distorted", "curved"])),
        "orthotropy": draw(st.one_of(st.just(0.0), powers(0.5, 2.0))),
        "step_fraction": draw(numbers(0.4, 0.95)),
        "layers": draw(st.integers(4, 5)),
        "columns": draw(st.integers(2, 3)),
        "height": height,
        "thinnest": draw(numbers(0.1, 1.0)) if height > 1 else 1.0,
    }


@st.composite
def free_pairs(draw: st.DrawFn) -> dict[str, Any]:
    """A pair that nothing holds."""
    return draw(pairs()) | {"free": True, "windows": draw(st.integers(400, 1000))}


@st.composite
def ties(draw: st.DrawFn) -> dict[str, Any]:
    """A pair whose block is a little off the face."""
    return draw(pairs()) | {"offset": draw(quantities(-1.0, 1.0, "nm"))}


@st.composite
def pulses(draw: st.DrawFn) -> dict[str, Any]:
    """A pulse that runs into a finer bar."""
    return {
        "scheme": draw(st.sampled_from(SCHEMES[:4])),
        "substeps": draw(st.integers(2, 15)),
        "impedance": draw(powers(-1.0, 1.0)),
        "mesh_ratio": draw(st.integers(1, 4)),
        "elements": draw(st.integers(20, 40)),
    }


RANDOM = [
    RandomTrial(
        name="coupling_random_windows",
        title="random windows: scheme, m, impedance, mesh ratio, shape, laminate, layers, step",
        why="No scheme that the program offers grows, whatever it couples: spectral radius at most 1.",
        trial="window",
        tables=pairs(),
        bounds={"growth": "1e-8"},
        share=2,
    ),
    RandomTrial(
        name="coupling_random_free_pairs",
        title="random free pairs that swing for hundreds of windows",
        why="What both models and the interface hold adds up to what was given; no push comes from nowhere.",
        trial="windows",
        tables=free_pairs(),
        bounds={"energy_error": "1e-8", "momentum_error": "2 %"},
    ),
    RandomTrial(
        name="coupling_random_ties",
        title="random ties and cuts: shape, mesh ratio, nodes off the face",
        why="Rigid motions, linear fields, forces and masses go through tie and cut exactly.",
        trial="transfer",
        tables=ties(),
        bounds=dict.fromkeys(("rigid_error", "linear_error", "tie_error", "cut_error", "mass_error"), "1e-12"),
    ),
    RandomTrial(
        name="coupling_random_pulses",
        title="random pulses into a finer bar: scheme, m, impedance, mesh ratio, length",
        why="What comes back is what the impedances say, to second order in the window.",
        trial="reflection",
        tables=pulses(),
        bounds={"reflection_error": "6 %", "energy_error": "1e-8"},
    ),
]
