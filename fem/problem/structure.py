"""Parameters of a structure: a box of layers, its supports and loads, and the computation of its motion.

All values are SI floats; ``Quantity`` names the unit that case files and messages use (for a tuple, the unit of its
items). Named tables are dictionaries, so that a single value of a single table can be overridden.
"""

import math
from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from reflowshock.fem.problem.filters import LowPass
from reflowshock.fem.problem.fittings import (
    AXES,
    Axis,
    Fittings,
    PointMass,
    StrainGauge,
    Support,
    WatchPoint,
)
from reflowshock.fem.problem.kinematics import Kinematics
from reflowshock.fem.problem.load_kinds import StructureLoad
from reflowshock.fem.problem.shock import MOST_RANKS, Coupling, Damping
from reflowshock.materials.library import LIBRARY
from reflowshock.materials.parameters import Material
from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

ROUNDING = 1e-9  # distance over the size of the box below which two points coincide
FINE_STEP = 0.5  # critical step over the longest one of a layer below which a layer is fine by default
SolverName = Literal["explicit", "implicit", "dns"]
Cells = Annotated[int, Field(ge=1, le=2000)]


class Layer(Parameters):
    """Layer of a structure: material name, thickness and number of elements over the thickness.

    ``in_plane`` overrides the numbers of elements along x and y, ``cells`` of the structure. Layers whose numbers
    differ are tied.
    """

    material: str
    thickness: Annotated[float, Quantity("mm")] = Field(gt=0)
    cells: int = Field(1, ge=1, le=1000)
    in_plane: tuple[Cells, Cells] | None = None


class Holes(Parameters):
    """Four mounting holes through all layers at (+-spacing/2); their walls are the facet set ``mounting_holes``."""

    spacing: Annotated[tuple[float, float], Quantity("mm")]
    diameter: Annotated[float, Quantity("mm")] = Field(gt=0)

    @property
    def places(self) -> tuple[tuple[float, float], ...]:
        """Coordinates x, y of the four axes [m]."""
        x, y = (0.5 * spacing for spacing in self.spacing)
        return (-x, -y), (-x, y), (x, -y), (x, y)


class Structure(Parameters):
    """Box of layers, centred on x = y = 0, with z = 0 at its bottom.

    With a plane of symmetry in x only x >= 0 is meshed; ``x_min`` is then that plane, and the displacement normal to it
    is zero. ``length`` and ``width`` refer to the whole body, ``cells`` to the meshed part. ``refine`` multiplies all
    numbers of elements, along and across the layers; products are rounded and at least one.
    """

    length: Annotated[float, Quantity("mm")] = Field(gt=0)
    width: Annotated[float, Quantity("mm")] = Field(gt=0)
    cells: tuple[Cells, Cells]
    refine: float = Field(1.0, gt=0, le=100)
    layers: dict[str, Layer]
    symmetry: tuple[Literal["x", "y"], ...] = ()
    element: Literal["hexahedron", "tetrahedron", "tetrahedron_quadratic"] = "hexahedron"
    formulation: Literal["incompatible_modes", "one_point"] = "incompatible_modes"
    holes: Holes | None = None

    @property
    def refined(self) -> "Structure":
        """Same structure with all numbers of elements multiplied by ``refine``."""
        layers = {
            name: layer.model_copy(
                update={
                    "cells": _times(self.refine, layer.cells),
                    "in_plane": layer.in_plane and _each(self.refine, layer.in_plane),
                }
            )
            for name, layer in self.layers.items()
        }
        return self.model_copy(update={"cells": _each(self.refine, self.cells), "layers": layers, "refine": 1.0})

    @property
    def thickness(self) -> float:
        """Total thickness of the layers [m]."""
        return sum(layer.thickness for layer in self.layers.values())

    @property
    def corners(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Lowest and highest corner of the meshed box [m]."""
        x, y = 0.5 * self.length, 0.5 * self.width
        low = (0.0 if "x" in self.symmetry else -x, 0.0 if "y" in self.symmetry else -y, 0.0)
        return low, (x, y, self.thickness)

    @property
    def facet_sets(self) -> tuple[str, ...]:
        """Names of the facet sets for supports and loads."""
        sides = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")
        return sides if self.holes is None else (*sides, "mounting_holes")

    @property
    def margin(self) -> float:
        """Distance below which two points coincide [m]."""
        return ROUNDING * max(self.length, self.width, self.thickness)

    def planes_at(self, place: tuple[float, float, float]) -> tuple[Axis, ...]:
        """Return the axes of the planes of symmetry that contain a point [m]."""
        return tuple(axis for axis in dict.fromkeys(self.symmetry) if abs(place[AXES.index(axis)]) <= self.margin)


def _each(factor: float, counts: tuple[int, int]) -> tuple[int, int]:
    return _times(factor, counts[0]), _times(factor, counts[1])


def _times(factor: float, count: int) -> int:
    """Multiply a number of elements and round half up, so that proportional meshes stay proportional."""
    return max(1, math.floor(factor * count + 0.5))


class LayerCoupling(Coupling):
    """Coupling of two models of a structure: fine layers at small steps, the other layers at the window.

    ``fine`` names the fine layers; the default is all layers whose critical step is less than half of the longest.
    ``compare`` also runs a single model at the smallest step (DNS). ``macro_ranks`` is the number of ranks of the other
    layers with ``placement = disjoint``.
    """

    fine: tuple[str, ...] = ()
    compare: bool = False
    placement: Literal["auto", "disjoint", "shared"] = "auto"
    macro_ranks: int | None = Field(None, ge=1, le=MOST_RANKS)


def fine_layers(coupling: LayerCoupling, steps: Mapping[str, float]) -> tuple[str, ...]:
    """Return the names of the fine layers, which form the meso model, in their order.

    Args:
        coupling: Coupling settings; if they name fine layers, these are returned.
        steps: Layer name -> critical step [s]; if no layers are named, those below half the largest critical step are
            fine.
    """
    return coupling.fine or tuple(name for name, step in steps.items() if step < FINE_STEP * max(steps.values()))


class DynamicsNumerics(Parameters):
    """Numerical parameters of a motion.

    ``mass_scaled`` names the layers with mass scaling; ``explicit_step`` takes precedence over ``step_fraction``.
    """

    step_fraction: float = Field(0.9, gt=0, le=0.99)
    critical_step: Literal["element", "power_iteration"] = "element"
    explicit_step: Annotated[float | None, Quantity("us")] = Field(None, gt=0)
    implicit_step: Annotated[float | None, Quantity("us")] = Field(None, gt=0)
    hht_alpha: float = Field(0.0, ge=-1 / 3, le=0)
    mass_scaled: tuple[str, ...] = ()
    energy_balance_limit: float = Field(0.02, gt=0)
    history_samples: int = Field(600, ge=2)
    field_samples: int = Field(12, ge=2)
    checkpoint_seconds: Annotated[float, Quantity("s")] = Field(300.0, gt=0)
    watchdog_seconds: Annotated[float, Quantity("s")] = Field(60.0, gt=0)


class Dynamics(Parameters):
    """Duration, solver and outputs of a motion.

    ``modes`` is the number of natural frequencies, from the lowest. ``filter`` is applied to accelerations at watch
    points. With a coupling, ``solver = dns`` computes a single model at the smallest step instead of two models.
    """

    duration: Annotated[float, Quantity("ms")] = Field(gt=0)
    solver: Literal["explicit", "implicit", "both", "dns"] = "explicit"
    kinematics: Kinematics = "small"
    initial_velocity: Annotated[tuple[float, float, float], Quantity("m/s")] = (0.0, 0.0, 0.0)
    damping: Damping = Damping()
    filter: LowPass = LowPass()
    modes: int = Field(0, ge=0, le=200)
    ranks: int = Field(1, ge=1, le=MOST_RANKS)
    coupling: LayerCoupling | None = None
    numerics: DynamicsNumerics = DynamicsNumerics()

    @property
    def solvers(self) -> tuple[SolverName, ...]:
        """Solvers to run, each separately; with a coupling, the explicit solver is the coupled one."""
        chosen: tuple[SolverName, ...] = ("explicit", "implicit") if self.solver == "both" else (self.solver,)
        compared = self.coupling is not None and self.coupling.compare and self.solver != "dns"
        return (*chosen, "dns") if compared else chosen


class StructureProblem(Parameters):
    """Structure, supports, loads and motion; ``structure_checks.problems`` checks their consistency."""

    structure: Structure
    materials: dict[str, Material] = Field(default_factory=dict)
    supports: dict[str, Support] = Field(default_factory=dict)
    masses: dict[str, PointMass] = Field(default_factory=dict)
    loads: dict[str, StructureLoad] = Field(default_factory=dict)
    watch: dict[str, WatchPoint] = Field(default_factory=dict)
    gauges: dict[str, StrainGauge] = Field(default_factory=dict)
    dynamics: Dynamics

    @property
    def fittings(self) -> Fittings:
        """Supports, masses, watch points and gauges."""
        return Fittings(**{name: getattr(self, name) for name in Fittings.model_fields})

    @property
    def known_materials(self) -> dict[str, Material]:
        """Materials by name; materials of the problem take precedence over the library."""
        return self.materials | {name: material for name, material in LIBRARY.items() if name not in self.materials}

    @property
    def layer_materials(self) -> dict[str, Material]:
        """Material of each layer; an unknown name raises ``KeyError``."""
        materials = self.known_materials
        return {name: materials[layer.material] for name, layer in self.structure.layers.items()}
