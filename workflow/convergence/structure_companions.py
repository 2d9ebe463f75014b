"""Companions of a structure: the same motion on coarser meshes, or with half the window, run to estimate errors.

A window is the interval between two exchanges of the coupled models. Fewer than four elements along an axis stay,
because they cannot be coarsened by 1.5: a plate with one element over its thickness would have no bending strain at the
middle of the element.
"""

from collections.abc import Sequence
from math import floor, prod
from pathlib import Path

from reflowshock.fem.problem.structure import Layer
from reflowshock.parameters import Values, with_values
from reflowshock.workflow.store.companions import CHEAP, COARSEST, HALF_WINDOW, SIZES, size_name
from reflowshock.workflow.structure.case import StructureCase

FEWEST = 4  # smallest number of elements along an axis that companions coarsen


def structure_companions(case: StructureCase, _shock: Path | None) -> dict[str, StructureCase]:
    """Return the companions of a structure, the same case on coarser meshes from whose results errors are estimated.

    Args:
        case: Case of the run.
        _shock: Folder of the results of its shock, not used.

    Returns:
        Case of each companion by name, ``size_1.5``, ``size_2`` and perhaps ``half_window``; empty if the case
        estimates no errors.
    """
    if not case.estimates_errors:
        return {}
    copies = {size_name(size): _coarser(case, size) for size in SIZES}
    coupling = case.dynamics.coupling
    if coupling is None or coupling.compare or case.dynamics.solver == "dns":
        return copies
    return copies | _for_two_scales(case, copies[COARSEST])


def structure_sizes(case: StructureCase, shock: Path) -> dict[str, float]:
    """Return the realised element size of each companion, the case on a coarser mesh, relative to the case, by name.

    Rounded numbers of elements differ from the nominal size. Axes along which the number stays do not count; the size
    is the geometric mean of the others, 1 without any.

    Args:
        case: Case of the run.
        shock: Folder of the results of its shock.
    """
    return {name: _relative_size(case, copy) for name, copy in structure_companions(case, shock).items()}


def _relative_size(case: StructureCase, copy: StructureCase) -> float:
    """Return the size of the elements of a companion relative to the case."""
    numbers = list(zip(_elements_along_axes(case), _elements_along_axes(copy), strict=True))
    axes = sum(fine != coarse for fine, coarse in numbers)
    return float(prod(fine / coarse for fine, coarse in numbers) ** (1.0 / axes)) if axes else 1.0


def _elements_along_axes(case: StructureCase) -> tuple[int, int, int]:
    """Return the numbers of elements along length, width and thickness."""
    body = case.structure.refined
    return *body.cells, sum(layer.cells for layer in body.layers.values())


def _coarser(case: StructureCase, size: float) -> StructureCase:
    """Return a structure with larger elements, and time steps that grow with them, of the first solver alone."""
    numerics, solver, body = case.dynamics.numerics, case.dynamics.solvers[0], case.structure.refined
    values: Values = {
        "numerics.error.method": "off",
        "structure.refine": 1.0,
        "structure.cells": _fewer(body.cells, size),
        "structure.layers": {name: _coarser_layer(layer, size) for name, layer in body.layers.items()},
        "dynamics.solver": solver,
        "dynamics.ranks": 1,
        "dynamics.numerics.field_samples": 2,
    }
    if numerics.explicit_step is not None:
        values["dynamics.numerics.explicit_step"] = size * numerics.explicit_step
    if solver == "implicit":
        values["dynamics.numerics.implicit_step"] = size * _implicit_step(case)
    if case.dynamics.coupling is not None:
        values |= {
            "dynamics.modes": 0,  # which two models cannot compute
            "dynamics.coupling.compare": False,
            "dynamics.coupling.placement": "auto",
            "dynamics.coupling.macro_ranks": None,
        }
    return with_values(case, values)


def _coarser_layer(layer: Layer, size: float) -> Layer:
    """Return a layer with larger elements."""
    (cells,), in_plane = _fewer((layer.cells,), size), layer.in_plane and _fewer(layer.in_plane, size)
    return with_values(layer, {"cells": cells, "in_plane": in_plane})


def _fewer(counts: Sequence[int], size: float) -> tuple[int, ...]:
    """Return numbers of elements divided by their relative size and rounded; small numbers stay."""
    return tuple(count if count < FEWEST else floor(count / size + 0.5) for count in counts)


def _implicit_step(case: StructureCase) -> float:
    """Return the time step of the implicit solver [s]."""
    from reflowshock.workflow.structure.forecast import forecast_layers, forecast_steps

    return forecast_steps(case, forecast_layers(case))["implicit"]


def _for_two_scales(case: StructureCase, coarsest: StructureCase) -> dict[str, StructureCase]:
    """Return the coarsest companion with one model if that is cheap, otherwise a companion with half the window."""
    one_model = with_values(coarsest, {"dynamics.solver": "dns"})
    if _core_seconds(one_model) <= CHEAP * _core_seconds(case):
        return {COARSEST: with_values(coarsest, {"dynamics.coupling.compare": True})}
    fraction = coarsest.dynamics.numerics.step_fraction
    return {HALF_WINDOW: with_values(coarsest, {"dynamics.numerics.step_fraction": 0.5 * fraction})}


def _core_seconds(case: StructureCase) -> float:
    """Predict the processor time of a shock [s]."""
    from reflowshock.workflow.structure.forecast import forecast_structure

    return case.ranks * forecast_structure(case).seconds["shock"]
