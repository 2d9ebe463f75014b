"""Parameters of molten solder and of the computation of its flow.

All values are SI floats; ``Quantity`` has the unit of the case file.
"""

import math
from typing import Annotated, Literal

from pydantic import Field

from reflowshock.effect import Switch
from reflowshock.parameters import Parameters
from reflowshock.particles.parameters.schemes import Scheme, SchemeOrAuto, Wall
from reflowshock.quantity import Quantity


class SchemeNumerics(Parameters):
    """Numerical parameters of a reflow, apart from the resolution.

    The scheme energy minimises the energy of the tracked surface at constant volume, and uses tetrahedra for inertia
    and viscosity. The scheme ispg is a stable form of the method of Hu et al., with inertia, for drops on a wall,
    merging drops and joints. The scheme auto selects ispg where it is verified, since it costs less than tetrahedra,
    and energy otherwise. The scheme gripc is the method as published by Hu et al., for comparison: its time steps are
    bounded by the capillary limit, and drops break up.

    The default of max_steps is 1000; with ispg it grows by the steps in which the slowest oscillation decays.
    """

    scheme: SchemeOrAuto = "auto"
    basis: Literal["linear", "quadratic"] = "quadratic"
    time_step_limit: float = Field(20.0, gt=0, le=100)
    tolerance: float = Field(1.0e-6, gt=0, lt=1)
    max_steps: int | None = Field(None, ge=1)


class SolderNumerics(SchemeNumerics):
    """Numerical parameters of a reflow with a resolved scheme."""

    scheme: Scheme = "energy"
    spacing: Annotated[float, Quantity("mm")] = Field(4.0e-5, gt=0)


class Reflow(Parameters):
    """Parallel execution of an array of joints: a number of MPI ranks or, by default, processes on the available cores.

    The results are identical to the last bit. Ranks may run on several machines that share the run folder.
    """

    ranks: int | None = Field(None, ge=1, le=100_000)


class FlowEffects(Parameters):
    """Effects of a reflow except gravity: decided from dimensionless numbers (auto), or set by the user."""

    inertia: Switch = "auto"
    viscosity: Switch = "auto"
    surface_tension: Switch = "auto"
    wall_adhesion: Switch = "auto"


class Walls(Parameters):
    """Wall condition of viscous flow; contact lines move in any case.

    The slip length is for wall = "slip" (Navier): the depth below the wall at which the extrapolated flow would rest.
    """

    wall: Wall = "free-slip"
    slip_length: Annotated[float | None, Quantity("mm")] = Field(None, gt=0)


class Process(Walls):
    """Walls, gravity and process time, shared by the solder of packages and of scenes; parameters of effects."""

    gravity: Annotated[float, Quantity("m/s^2")] = Field(9.81, ge=0)
    process_time: Annotated[float, Quantity("s")] = Field(60.0, gt=0)


class SolderEffects(FlowEffects):
    """Effects of a reflow: decided from dimensionless numbers (auto), or set by the user."""

    gravity: Switch = "auto"


class Solder(Process):
    """Molten solder: volume of one ball, fluid properties, contact angles and process."""

    volume: Annotated[float, Quantity("mm^3")] = Field(gt=0)
    density: Annotated[float, Quantity("kg/m^3")] = Field(8930.0, gt=0)
    surface_tension: Annotated[float, Quantity("N/m")] = Field(0.4985, gt=0)
    viscosity: Annotated[float, Quantity("Pa*s")] = Field(2.27e-3, gt=0)
    pad_contact_angle: Annotated[float, Quantity("deg")] = Field(math.radians(5.0), gt=0, lt=3.14159265)
    mask_contact_angle: Annotated[float, Quantity("deg")] = Field(math.radians(148.0), gt=0, lt=3.14159265)
    effects: SolderEffects = SolderEffects()
    numerics: SolderNumerics = SolderNumerics()
