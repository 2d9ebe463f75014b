"""Estimated parts of the mesh of a shock: elements, critical time steps, cost of an update."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from reflowshock.materials.parameters import Material

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from reflowshock.meshing.board.estimate import PartEstimate
    from reflowshock.workflow.package.case import BoardDropCase

MACRO = "board"  # part of the macro model
BOXES = ("board", "substrate", "die")  # roles with box elements, except in columns
IN_COLUMN = "column"  # name of columns in ``shock.numerics.mass_scaled``
MOST_ELEMENTS = 10_000_000  # largest part whose element shapes are computed; larger ones are never meshed
COLUMN = f"_{IN_COLUMN}"  # ends the names of parts of board and substrate around fine joints


@dataclass(frozen=True, slots=True)
class PartForecast:
    """A part of the mesh.

    Attributes:
        elements: Number of hexahedra.
        critical_step: Critical step of the smallest element [s].
        scaled_step: Critical step with mass scaling [s].
        cost: Cost of an update of an element, in updates of an assembled elastic element.
        linear: Whether the force is linear in the displacement.
        in_boxes: Cost of an update of all elements, in updates of a linear box in a long row.
    """

    elements: int
    critical_step: float
    scaled_step: float
    cost: float
    linear: bool
    in_boxes: float


Parts = Mapping[str, PartForecast]


def forecast_parts(case: "BoardDropCase") -> dict[str, PartForecast]:
    """Return the forecast of every part of the mesh with all joints fine, by name such as "board" or "solder".

    Returns:
        Part name -> number of hexahedra, critical time step [s] (with mass scaling, too), cost of an update in
        updates of an assembled elastic element, and whether the forces are linear.
    """
    from reflowshock.meshing.board.estimate import count_elements

    return _forecasts(case, count_elements(case.package, case.board, case.warpage))


def two_scale_parts(case: "BoardDropCase") -> dict[str, PartForecast]:
    """Return the forecast of every part of a two-scale run by name; for a one-way run, the parts of both models.

    Returns:
        Part name -> number of hexahedra, critical time step [s], cost of an update, and whether the forces are linear.
    """
    from reflowshock.meshing.board.estimate import count_elements

    if case.shock.coupling.direction == "one_way":
        return _driven_parts(case) | coarse_parts(case)
    return _forecasts(case, count_elements(case.package, case.board, case.warpage, fine_joint_count(case)))


def coarse_parts(case: "BoardDropCase") -> dict[str, PartForecast]:
    """Return the forecast of every part of the mesh with all joints coarse, by name.

    Returns:
        Part name, such as "solder_coarse" -> number of hexahedra, critical time step [s], cost of an update, and
        whether the forces are linear.
    """
    from reflowshock.meshing.board.estimate import count_elements

    return _forecasts(case, count_elements(case.package, case.board, case.warpage, 0))


def _driven_parts(case: "BoardDropCase") -> dict[str, PartForecast]:
    """Estimate the fine joints of a one-way run, without the board around them."""
    from reflowshock.meshing.board.estimate import count_elements

    estimates = count_elements(case.package, case.board, case.warpage, fine_joint_count(case))
    return _forecasts(
        case, {name: part for name, part in estimates.items() if name in ("solder", "copper") or name.endswith(COLUMN)}
    )


def fine_joint_count(case: "BoardDropCase") -> int | None:
    """Return the number of fine joints of a two-scale run; None if all are fine."""
    coupling = case.shock.coupling
    if coupling.fine_joints == "all":
        return None
    return coupling.critical_joints if coupling.fine_joints == "critical" else len(set(coupling.fine_joints))


def _forecasts(case: "BoardDropCase", estimates: "Mapping[str, PartEstimate]") -> dict[str, PartForecast]:
    import numpy as np

    from reflowshock.fem.estimates.estimate import box_critical_step, skewed_critical_step

    scaled = case.shock.numerics.mass_scaled
    step = {name: box_critical_step(material_of(case, name), np.array(of.smallest)) for name, of in estimates.items()}
    for name, part in estimates.items():
        shapes = np.array(part.shapes) if part.shapes else _joint_shapes(case, name, part)
        if len(shapes):
            step[name] = min(step[name], float(skewed_critical_step(material_of(case, name), shapes).min()))
    heavier = {name for name in step if role_of(name) in scaled or (name.endswith(COLUMN) and IN_COLUMN in scaled)}
    smallest = min((step[name] for name in step if name not in heavier), default=min(step.values()))
    target = min(smallest, case.shock.numerics.mass_scaled_step or math.inf)
    raised = step | {name: max(step[name], target) for name in heavier}
    return {
        name: PartForecast(
            elements=part.elements,
            critical_step=step[name],
            scaled_step=raised[name],
            cost=relative_cost(case, name),
            linear=is_linear_part(case, name),
            in_boxes=_in_boxes(case, name, part),
        )
        for name, part in estimates.items()
    }


def _joint_shapes(case: "BoardDropCase", name: str, part: "PartEstimate") -> "NDArray[np.float64]":
    """Return the edges of the element shapes of a joint part, shape (n, 3, 3) [m]; n = 0 for other parts."""
    import numpy as np

    from reflowshock.meshing.joint.butterfly import section_edges

    package = case.package
    fine = package.joint_numerics
    numerics = {"solder": fine, "copper": fine, "solder_coarse": package.coarse_joint_numerics}.get(name)
    if numerics is None or part.elements > MOST_ELEMENTS:
        return np.empty((0, 3, 3))
    flat = section_edges(numerics, min(pad.wetted_radius for pad in (package.board_pad, package.package_pad)))
    shapes = np.zeros((len(flat), 3, 3))
    shapes[:, :2, :2], shapes[:, 2, 2] = flat, part.smallest[2]
    return shapes


def is_linear(parts: Parts) -> bool:
    """Return whether the forces of all parts are linear.

    Args:
        parts: Forecast of each part by name, of which ``linear`` is read.
    """
    return all(part.linear for part in parts.values())


def _in_boxes(case: "BoardDropCase", name: str, part: "PartEstimate") -> float:
    """Return the cost of an update of a whole part, in updates of a linear box in a long row."""
    from reflowshock.fem.estimates.estimate import BOARD_ADVANTAGE, ROW_COST, UPDATES_PER_SECOND
    from reflowshock.fem.estimates.solver_cost import TURNING_BOARD_RATE

    boxes = part.elements - part.around_holes
    if is_box(name) and is_linear_part(case, name):
        return boxes + ROW_COST * min(part.rows, boxes) + BOARD_ADVANTAGE * part.around_holes
    each = relative_cost(case, name)
    if is_box(name) and turns(case, name):
        return BOARD_ADVANTAGE * (UPDATES_PER_SECOND / TURNING_BOARD_RATE * boxes + each * part.around_holes)
    return BOARD_ADVANTAGE * each * part.elements


def relative_cost(case: "BoardDropCase", part: str) -> float:
    """Return the cost of an update of one element of a part, relative to a linear elastic element (1.0)."""
    from reflowshock.fem.estimates.estimate import UPDATES_PER_SECOND
    from reflowshock.fem.estimates.solver_cost import NONLINEAR_RATE, TURNING_BOX_RATE, TURNING_RATE

    numerics = case.shock.numerics
    if is_linear_part(case, part):
        return 1.0
    if turns(case, part):
        box = is_box(part) or (role_of(part) in BOXES and not part.endswith(COLUMN) and not _warped(case))
        return UPDATES_PER_SECOND / (TURNING_BOX_RATE if box else TURNING_RATE)
    return UPDATES_PER_SECOND / NONLINEAR_RATE[numerics.formulation]


def _warped(case: "BoardDropCase") -> bool:
    """Return whether the package is meshed warped or displaced, so that its elements are not boxes."""
    return case.thermal is not None or any(case.warpage.model_dump().values())


def turns(case: "BoardDropCase", part: str) -> bool:
    """Return whether a part is elastic and computed with the corotational formulation, for finite rotations.

    Args:
        case: Case with decided kinematics.
        part: Name of the part.
    """
    return case.shock.numerics.kinematics == "corotational" and material_of(case, part).plasticity is None


def is_linear_part(case: "BoardDropCase", part: str) -> bool:
    """Return whether the forces of a part are linear: elastic material and small rotations.

    Args:
        case: Case with decided kinematics.
        part: Name of the part.
    """
    return case.shock.numerics.kinematics == "small" and material_of(case, part).plasticity is None


def role_of(part: str) -> str:
    """Return the material role of a part: its name up to "@", then up to "_".

    Args:
        part: Name of the part, such as "solder_coarse" with the role "solder".
    """
    return part.split("@")[0].split("_")[0]


def is_box(part: str) -> bool:
    """Return whether a part consists of the board's boxes, not of a column around a fine joint."""
    return role_of(part) == MACRO and not part.endswith(COLUMN)


def material_of(case: "BoardDropCase", part: str) -> Material:
    """Return the material of a part of the mesh, by the role in its name."""
    return getattr(case.materials, role_of(part))
