"""Drop on a coarser mesh, for estimates of discretisation errors and for the search for critical joints.

The search keeps the layers of board, substrate, die and copper and those of the averaging layer of a joint.
"""

from math import floor

from reflowshock.parameters import Values, with_values
from reflowshock.workflow.package.case import BoardDropCase

SEARCH = 2.0  # element size of the search for critical joints, relative to the case
JOINTS = "package.joint_numerics"


def search_case(case: BoardDropCase) -> BoardDropCase:
    """Return the case of a search for critical joints: larger elements, all joints coarse, and no output but histories.

    With temperatures, the elements keep their size, because the meshes then depend on the reflow.

    Args:
        case: Case of the run, not changed.
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
    """Return whether a run on a coarser mesh must first find the critical joints, or the end, of a two-scale run.

    The end is searched for if the duration is automatic, damping acts, and no temperatures are computed.

    Args:
        case: Case of the run.
    """
    shock = case.shock
    finds_end = shock.duration == "auto" and case.shock.damping.acts and not case.thermal
    return "two_scale" in shock.numerics.modes and (shock.coupling.fine_joints == "critical" or finds_end)


def coarser(case: BoardDropCase, size: float) -> Values:
    """Return the values that multiply the element size along board and package (in plane).

    Args:
        case: Case of the run, not changed.
        size: Element size relative to the case; above one is coarser.

    Returns:
        Dotted key of the case -> value in SI units, for ``with_values``; the layers across the thickness keep their
        number, except those of the joints without a pad layer.
    """
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


def fewer_layers(case: BoardDropCase, size: float) -> Values:
    """Return the values that multiply the element size across all layers (through the thickness).

    Args:
        case: Case of the run, not changed.
        size: Element size relative to the case; above one is coarser.

    Returns:
        Dotted key of the case -> number of elements, for ``with_values``.
    """
    board, package, numerics = case.board.numerics, case.package, case.package.joint_numerics
    layers = rounded_count(board.layers, size)
    return {
        "board.numerics.layers": layers,
        "board.numerics.patch_layers": max(1, round(layers * board.patch_layers / board.layers)),
        "package.substrate.elements": rounded_count(package.substrate.elements, size),
        "package.die.elements": rounded_count(package.die.elements, size),
        f"{JOINTS}.layers": max(2, rounded_count(numerics.layers, size)),
        f"{JOINTS}.pad_layers": rounded_count(numerics.pad_layers, size),
        f"{JOINTS}.copper_layers": rounded_count(numerics.copper_layers, size),
    }


def rounded_count(elements: int, size: float) -> int:
    """Return a number of elements divided by ``size``, their relative size, rounded; at least one."""
    return max(1, floor(elements / size + 0.5))
