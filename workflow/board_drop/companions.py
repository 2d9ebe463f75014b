"""Companions of a drop: the same drop on two coarser meshes, for discretisation errors and critical joints.

The fine joints and the end of a companion are those of the run. Layers of board, substrate, die and copper and those of
the averaging layer of a joint stay, because so few elements cannot be coarsened by 1.5.
"""

from functools import reduce
from math import floor
from pathlib import Path
from typing import Any

from reflowshock.meshing.board.pads import pad_table
from reflowshock.parameters import with_value
from reflowshock.workflow.board_drop.board_deflection import decided, expected_duration
from reflowshock.workflow.board_drop.fine_joints import read_fine_joints
from reflowshock.workflow.board_drop.shock_launch import MODES
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.process.products import read_json

SIZES = (1.5, 2.0)  # element sizes relative to the case
SEARCH = 2.0  # that of the search for critical joints
JOINTS = "package.joint_numerics"

Values = dict[str, Any]


def companions(case: BoardDropCase, shock: Path | None) -> dict[float, BoardDropCase]:
    """Return the companions of a drop by element size relative to the case; none if the case estimates no errors.

    Args:
        case: Case of the run.
        shock: Product of its shock, which decides the fine joints and the end; None before, for the expected ones.
    """
    if not case.estimates_errors:
        return {}
    main = next(mode for mode in MODES if mode in case.shock.numerics.modes)
    same = {
        "numerics.error.method": "off",
        "shock.coupling.fine_joints": _fine_joints(case, shock) if main == "two_scale" else "all",
        "shock.duration": _end(case, shock, main),
        "shock.numerics.modes": (main,),
        "shock.numerics.field_samples": 2,
        "shock.modes": 0,
        "shock.identical_joints": False,
        "shock.ranks.total": 1,
        "shock.ranks.placement": "auto",
        "shock.ranks.macro": None,
    }
    return {size: with_values(case, same | coarser(case, size)) for size in SIZES}


def search_case(case: BoardDropCase) -> BoardDropCase:
    """Return the case of a search: larger elements, all joints coarse, and no output but histories.

    With temperatures, the elements keep their size, because the meshes then depend on the reflow.
    """
    same = {
        "shock.coupling.fine_joints": "all",
        "shock.coupling.direction": "two_way",
        "shock.numerics.modes": ("two_scale",),
        "shock.numerics.field_samples": 2,
        "shock.picture_times": (),
        "shock.modes": 0,
    }
    return with_values(case, same | ({} if case.thermal else coarser(case, SEARCH)))


def needs_search(case: BoardDropCase) -> bool:
    """Return whether a two-scale run has critical joints, or an end, that a search must find."""
    shock = case.shock
    finds_end = shock.duration == "auto" and decided(case).shock.damping.acts and not case.thermal
    return "two_scale" in shock.numerics.modes and (shock.coupling.fine_joints == "critical" or finds_end)


def with_values(case: BoardDropCase, values: Values) -> BoardDropCase:
    """Return a copy of a case with other values at dotted keys."""
    return reduce(lambda copy, item: with_value(copy, *item), values.items(), case)


def coarser(case: BoardDropCase, size: float) -> Values:
    """Return the values that multiply the element size of a case: dotted key -> value in SI units."""
    board, package, numerics = case.board.numerics, case.package, case.package.joint_numerics
    values: Values = {
        "board.numerics.element_size": size * board.element_size,
        "board.numerics.coarse_size": size * board.coarse_size,
        "package.numerics.element_size": size * package.numerics.element_size,
        f"{JOINTS}.core": rounded_count(numerics.core, size),
        f"{JOINTS}.rings": rounded_count(numerics.rings, size) if numerics.rings else 0,
    }
    if numerics.pad_layer is None:
        values[f"{JOINTS}.layers"] = max(2, rounded_count(numerics.layers, size))
    if package.imprint is not None:
        values |= {
            "package.imprint.rings": rounded_count(package.imprint.rings, size),
            "package.imprint.first_layer": size * package.imprint.first_layer,
            "package.imprint.growth": 1.0 + size * (package.imprint.growth - 1.0),
        }
    step = case.shock.numerics.mass_scaled_step
    return values if step is None else values | {"shock.numerics.mass_scaled_step": size * step}


def rounded_count(elements: int, size: float) -> int:
    """Return a number of elements divided by their relative size, rounded, at least one."""
    return max(1, floor(elements / size + 0.5))


def _fine_joints(case: BoardDropCase, shock: Path | None) -> tuple[str, ...] | str:
    """Return the fine joints of a run; before it, as many joints as it will have."""
    chosen = case.shock.coupling.fine_joints
    if chosen != "critical":
        return chosen
    found = None if shock is None else read_fine_joints(shock)
    if found is not None:
        return found.names
    names = tuple(pad.name for pad in pad_table(case.package, case.board, case.warpage))
    return names[: case.shock.coupling.critical_joints]


def _end(case: BoardDropCase, shock: Path | None, mode: str) -> float:
    """Return the end of a run [s]; before it, the expected one."""
    if case.shock.duration != "auto":
        return case.shock.duration
    if shock is None:
        return expected_duration(case)
    model = read_json(shock / mode / "result.json")["model"]
    end: float = model["window"] * model["windows"]
    return end
