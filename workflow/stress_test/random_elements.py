"""Random bodies of elements: any kind, shape, material and contrast within what a trial allows."""

from typing import Any

from hypothesis import strategies as st

from reflowshock.workflow.stress_test.random_trial import RandomTrial, numbers, quantities

KINDS = st.sampled_from(["incompatible_modes", "one_point", "tetrahedron", "tetrahedron_quadratic"])
HEXAHEDRA = st.sampled_from(["incompatible_modes", "one_point"])


def powers(low: float, high: float) -> st.SearchStrategy[float]:
    """Draw positive numbers of any size between two powers of ten, to four digits."""
    return numbers(low, high).map(lambda exponent: float(f"{10.0**exponent:.4g}"))


@st.composite
def elastic(draw: st.DrawFn) -> dict[str, Any]:
    """An elastic body."""
    return {
        "element": draw(KINDS),
        "poisson_ratio": draw(numbers(0.0, 0.4999)),
        "orthotropy": draw(powers(-2.0, 2.0)),
        "quality": draw(numbers(0.15, 1.0)),
        "aspect": draw(powers(0.0, 1.5)),
        "cells": draw(st.integers(2, 4)),
        "seed": draw(st.integers(0, 10_000)),
    }


@st.composite
def flights(draw: st.DrawFn) -> dict[str, Any]:
    """A free body, damped or not, with a foil of copper or not."""
    stiffness = draw(st.sampled_from([0.0, 0.0, 0.01, 0.2]))
    return draw(elastic()) | {
        "contrast": draw(powers(0.0, 5.0)),
        "foil": draw(st.one_of(st.just("0 um"), quantities(1.0, 100.0, "um"))),
        "mass_scaled": draw(st.booleans()),
        "critical_step": draw(st.sampled_from(["element", "power_iteration"])),
        "step_fraction": draw(numbers(0.3, 0.99)),
        "stiffness_damping": stiffness,
        "steps": draw(st.integers(500, 3000)),
    }


@st.composite
def impacts(draw: st.DrawFn) -> dict[str, Any]:
    """A rod that strikes a wall."""
    return {
        "element": draw(HEXAHEDRA),
        "kinematics": draw(st.sampled_from(["small", "finite"])),
        "speed": draw(quantities(5.0, 150.0, "m/s")),
        "skew": draw(numbers(0.0, 2.0)),
        "step_fraction": draw(numbers(0.2, 0.9)),
        "steps": draw(st.integers(50, 400)),
    }


@st.composite
def patches(draw: st.DrawFn) -> dict[str, Any]:
    """A distorted body in an affine field."""
    return draw(elastic()) | {"kinematics": draw(st.sampled_from(["small", "finite"]))}


@st.composite
def tensions(draw: st.DrawFn) -> dict[str, Any]:
    """A distorted body of metal that is pulled."""
    body = {name: value for name, value in draw(elastic()).items() if name in ("element", "quality", "cells", "seed")}
    return body | {"plastic_strain": draw(powers(-4.0, -0.5)), "steps": draw(st.integers(1, 50))}


RANDOM = [
    RandomTrial(
        name="elements_random_patches",
        title="random patches: kind, distortion, flatness, laminate, kinematics",
        why="An affine field has one stress and leaves inner nodes without force; turning has no energy.",
        trial="patch",
        tables=patches(),
        bounds={"force_error": "1e-10", "stress_error": "1e-10", "rigid_mode": "1e-12"},
    ),
    RandomTrial(
        name="elements_random_flights",
        title="random free flights: kind, distortion, laminate, contrast, foil, mass scaling, damping, step",
        why="Central differences keep energy and both momenta of a linear body at any step below the critical one.",
        trial="flight",
        tables=flights(),
        bounds={"energy_error": "1e-6", "momentum_error": "1e-6", "angular_momentum_error": "1e-6"},
    ),
    RandomTrial(
        name="elements_random_impacts",
        title="random impacts of a rod of solder: speed, skew, kinematics, step",
        why="All energy is there or was taken by plastic flow, which gives nothing back.",
        trial="impact",
        tables=impacts(),
        bounds={"energy_error": "1 %", "plastic_return": "1e-12"},
    ),
    RandomTrial(
        name="elements_random_tensions",
        title="random pulls of a metal: kind, distortion, strain, steps",
        why="Proportional paths follow the law exactly in any number of steps.",
        trial="tension",
        tables=tensions(),
        bounds={"stress_error": "1e-8", "force_error": "1e-8"},
    ),
]
