"""Parameters of a structure: a box of layers, its supports and loads, and how its motion is computed.

All values are SI floats; ``Quantity`` has the unit in which a user sees them, that of a tuple each of its items.
Tables of named members are dictionaries, so that one value of one member can be set.
"""

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, get_args

from pydantic import Field

from reflowshock.fem.problem.filters import LowPass
from reflowshock.fem.problem.fittings import (
    AXES,
    Axis,
    Direction,
    Fittings,
    PointMass,
    StrainGauge,
    Support,
    WatchPoint,
)
from reflowshock.fem.problem.kinematics import Kinematics
from reflowshock.fem.problem.shock import MOST_RANKS, Coupling, Damping, ServiceCondition
from reflowshock.materials.library import LIBRARY
from reflowshock.materials.parameters import Material
from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

ROUNDING = 1e-9  # of the box: closer than that is the same place
SMALLER = 0.5  # of the longest step of a layer: below it a layer is fine, unless the user names those that are
SolverName = Literal["explicit", "implicit", "dns"]
Cells = Annotated[int, Field(ge=1, le=2000)]


class Layer(Parameters):
    """One layer: its material by name, and how many elements lie one above the other in it.

    ``in_plane`` are its elements along x and y where they are not the ``cells`` of the structure; layers that differ
    are tied.
    """

    material: str
    thickness: Annotated[float, Quantity("mm")] = Field(gt=0)
    cells: int = Field(1, ge=1, le=1000)
    in_plane: tuple[Cells, Cells] | None = None


class Holes(Parameters):
    """Four mounting holes at (+-spacing/2), through all layers; their walls are the facet set ``mounting_holes``."""

    spacing: Annotated[tuple[float, float], Quantity("mm")]
    diameter: Annotated[float, Quantity("mm")] = Field(gt=0)

    @property
    def places(self) -> tuple[tuple[float, float], ...]:
        """Their axes [m]."""
        x, y = (0.5 * spacing for spacing in self.spacing)
        return (-x, -y), (-x, y), (x, -y), (x, y)


class Structure(Parameters):
    """A box of layers, z = 0 at its bottom, centred on x = y = 0.

    With a plane of symmetry in x only x >= 0 is meshed: ``x_min`` is then that plane, and what crosses it is held.
    ``length`` and ``width`` are those of the whole body. ``cells`` are counted over the meshed part. ``refine``
    multiplies all numbers of elements, along and across the layers, each rounded and at least one.
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
        """Return the same structure with all numbers of elements multiplied by ``refine``."""
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
        """Return the thickness of all layers [m]."""
        return sum(layer.thickness for layer in self.layers.values())

    @property
    def corners(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Return the lowest and the highest corner of the meshed box [m]."""
        x, y = 0.5 * self.length, 0.5 * self.width
        low = (0.0 if "x" in self.symmetry else -x, 0.0 if "y" in self.symmetry else -y, 0.0)
        return low, (x, y, self.thickness)

    @property
    def facet_sets(self) -> tuple[str, ...]:
        """Return the names that supports and loads may refer to."""
        sides = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")
        return sides if self.holes is None else (*sides, "mounting_holes")

    @property
    def margin(self) -> float:
        """Return the distance [m] below which two places are the same."""
        return ROUNDING * max(self.length, self.width, self.thickness)

    def planes_at(self, place: tuple[float, float, float]) -> tuple[Axis, ...]:
        """Return the planes of symmetry on which a place [m] lies."""
        return tuple(axis for axis in dict.fromkeys(self.symmetry) if abs(place[AXES.index(axis)]) <= self.margin)


def _each(factor: float, counts: tuple[int, int]) -> tuple[int, int]:
    return _times(factor, counts[0]), _times(factor, counts[1])


def _times(factor: float, count: int) -> int:
    """Multiply a number of elements; halves go up, so that meshes of like proportions stay so."""
    return max(1, math.floor(factor * count + 0.5))


class Pulsed(Parameters):
    """A load whose value is its peak times a pulse of unit height, or the values of a table.

    ``half_sine`` and ``haversine``, its square, act for ``duration``; ``constant`` from the start, for ``duration`` or
    to the end. ``table`` is a CSV file of times and values and stands instead of peak and pulse; ``table_column``
    is the title of the values where it has several columns. A record that begins at a negative time is moved to zero.

    Attributes:
        effect: Its name among the effects of a run.
        quantity: What its values are, a key of ``fem.loads.pulse_table.QUANTITIES``.
    """

    effect: ClassVar[str]
    quantity: ClassVar[str]
    pulse: Literal["half_sine", "haversine", "constant"] = "half_sine"
    duration: Annotated[float | None, Quantity("ms")] = Field(None, gt=0)
    table: str | None = None
    table_column: str | None = None


class OnBody(Pulsed):
    """A load of the whole body, along ``direction``."""

    direction: Direction


class OnNodes(Pulsed):
    """A load of the nodes of a facet set."""

    on: str


class OnAreas(Pulsed):
    """A load per area of a facet set."""

    on: str


class AtPoint(Pulsed):
    """A load at a point, along ``direction``."""

    at: Annotated[tuple[float, float, float], Quantity("mm")]
    direction: Direction


class InputG(OnBody):
    """Acceleration of all supports along ``direction``; displacements are relative to them with ``direct``.

    Given by a JEDEC service condition, by peak and duration, or by a table.
    """

    effect: ClassVar = "input_g"
    quantity: ClassVar = "acceleration"
    kind: Literal["input_g"] = "input_g"
    service_condition: ServiceCondition | None = None
    peak: Annotated[float | None, Quantity("G")] = Field(None, gt=0)
    direction: Direction = (0.0, 0.0, 1.0)
    method: Literal["direct", "large_mass"] = "direct"


class Pressure(OnAreas):
    """Pressure on a facet set, positive where it pushes into the body.

    It follows the surface unless kinematics are small.
    """

    effect: ClassVar = "pressure"
    quantity: ClassVar = "pressure"
    kind: Literal["pressure"] = "pressure"
    peak: Annotated[float | None, Quantity("MPa")] = None


class PrescribedMotion(OnNodes):
    """Velocity of one component of a facet set."""

    effect: ClassVar = "prescribed_motion"
    quantity: ClassVar = "velocity"
    kind: Literal["motion"] = "motion"
    component: Axis
    peak: Annotated[float | None, Quantity("m/s")] = None


class Gravity(OnBody):
    """Weight, constant unless a pulse or a table says otherwise."""

    effect: ClassVar = "gravity"
    quantity: ClassVar = "acceleration"
    kind: Literal["gravity"] = "gravity"
    pulse: Literal["half_sine", "haversine", "constant"] = "constant"
    peak: Annotated[float, Quantity("m/s^2")] = Field(9.80665, gt=0)
    direction: Direction = (0.0, 0.0, -1.0)


class PointForce(AtPoint):
    """Force at a point, shared by the nodes of the element there; its direction stays also where the body turns.

    It is the force on the whole body: with a plane of symmetry its mirror image acts as well, and of a force on that
    plane each half bears half. Strains within an element of the point depend on the mesh.
    """

    effect: ClassVar = "point_force"
    quantity: ClassVar = "force"
    kind: Literal["point_force"] = "point_force"
    peak: Annotated[float | None, Quantity("N")] = Field(None, gt=0)


AnyLoad = InputG | Gravity | Pressure | PrescribedMotion | PointForce
StructureLoad = Annotated[AnyLoad, Field(discriminator="kind")]
KINDS: tuple[type[Pulsed], ...] = get_args(AnyLoad)


class LayerCoupling(Coupling):
    """Two models of a structure: fine layers, each at its own steps, and the others at the window's.

    ``fine`` are layers by name; without them those whose steps are less than half of the longest. ``compare`` also runs
    one model at the smallest step (DNS). ``macro_ranks`` are those of the other layers with ``disjoint``.
    """

    fine: tuple[str, ...] = ()
    compare: bool = False
    placement: Literal["auto", "disjoint", "shared"] = "auto"
    macro_ranks: int | None = Field(None, ge=1, le=MOST_RANKS)


def fine_layers(coupling: LayerCoupling, steps: Mapping[str, float]) -> tuple[str, ...]:
    """Return the fine layers of a structure, from the critical steps [s] of all its layers."""
    return coupling.fine or tuple(name for name, step in steps.items() if step < SMALLER * max(steps.values()))


class DynamicsNumerics(Parameters):
    """How the motion is computed; ``mass_scaled`` names layers, ``explicit_step`` goes before ``step_fraction``."""

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
    """What of the motion is wanted; ``modes`` is how many natural frequencies, the lowest ones.

    ``filter`` is that of the accelerations at watch points.
    ``dns`` is, where there is a coupling, one model at the smallest step instead of two.
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
        """Return the solvers to run, each on its own; the explicit one is the coupled one where there is a coupling."""
        chosen: tuple[SolverName, ...] = ("explicit", "implicit") if self.solver == "both" else (self.solver,)
        compared = self.coupling is not None and self.coupling.compare and self.solver != "dns"
        return (*chosen, "dns") if compared else chosen


class StructureProblem(Parameters):
    """All that describes a structure and its motion; ``structure_checks.problems`` says what does not fit together."""

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
        """Return supports, masses, watch points and gauges."""
        return Fittings(**{name: getattr(self, name) for name in Fittings.model_fields})

    @property
    def known_materials(self) -> dict[str, Material]:
        """Return the materials that layers may name: those of the problem, then those of the library."""
        return self.materials | {name: material for name, material in LIBRARY.items() if name not in self.materials}

    @property
    def layer_materials(self) -> dict[str, Material]:
        """Return the material of each layer; a name that is not known raises ``KeyError``."""
        known = self.known_materials
        return {name: known[layer.material] for name, layer in self.structure.layers.items()}
