"""Parameters of the molten solder and of how its flow is computed.

All values are SI floats; ``Quantity`` has the unit in which a user sees them.
"""

import math
from typing import Annotated, Literal

from pydantic import Field

from reflowshock.effect import Switch
from reflowshock.parameters import Parameters
from reflowshock.particles.parameters.schemes import Scheme, SchemeOrAuto, Wall
from reflowshock.quantity import Quantity


class FlowNumerics(Parameters):
    """How a reflow is computed, apart from its resolution.

    The scheme energy moves to the least energy of the tracked surface at exactly the volume, on tetrahedra where
    inertia or viscosity acts. The scheme ispg is the paper's method in a form that holds, for drops on a wall or that
    merge and for joints, with inertia. The scheme auto is ispg where that is verified, which costs less than
    tetrahedra, else energy. The scheme gripc is what Hu et al. print, for comparison: time steps end at the capillary
    limit, and drops break up.

    Where max_steps is not given, it is 1000; with ispg as many more as the slowest swing of the solder dies away in.
    """

    scheme: SchemeOrAuto = "auto"
    basis: Literal["linear", "quadratic"] = "quadratic"
    time_step_limit: float = Field(20.0, gt=0, le=100)
    tolerance: float = Field(1.0e-6, gt=0, lt=1)
    max_steps: int | None = Field(None, ge=1)


class SolderNumerics(FlowNumerics):
    """How the reflow is computed, by a scheme that is decided."""

    scheme: Scheme = "energy"
    spacing: Annotated[float, Quantity("mm")] = Field(4.0e-5, gt=0)


class Reflow(Parameters):
    """Who computes the joints of an array: as many MPI ranks, or, without a number, processes on the cores given.

    The joints are the same to the last bit. Ranks may be on several machines that see the run folder.
    """

    ranks: int | None = Field(None, ge=1, le=100_000)


class FlowEffects(Parameters):
    """Effects of a reflow but gravity: decided from dimensionless numbers (auto), or by the user."""

    inertia: Switch = "auto"
    viscosity: Switch = "auto"
    surface_tension: Switch = "auto"
    wall_adhesion: Switch = "auto"


class Walls(Parameters):
    """How liquid slides on walls where viscosity acts; contact lines move in any case.

    The slip length belongs to wall = "slip" (Navier): the depth below the wall at which the flow would rest.
    """

    wall: Wall = "free-slip"
    slip_length: Annotated[float | None, Quantity("mm")] = Field(None, gt=0)


class SolderEffects(FlowEffects):
    """Effects of the reflow: decided from dimensionless numbers (auto), or by the user."""

    gravity: Switch = "auto"


class Solder(Walls):
    """Molten solder: volume of a ball, fluid properties, contact angles, process."""

    volume: Annotated[float, Quantity("mm^3")] = Field(gt=0)
    density: Annotated[float, Quantity("kg/m^3")] = Field(8930.0, gt=0)
    surface_tension: Annotated[float, Quantity("N/m")] = Field(0.4985, gt=0)
    viscosity: Annotated[float, Quantity("Pa*s")] = Field(2.27e-3, gt=0)
    pad_contact_angle: Annotated[float, Quantity("deg")] = Field(math.radians(5.0), gt=0, lt=3.14159265)
    mask_contact_angle: Annotated[float, Quantity("deg")] = Field(math.radians(148.0), gt=0, lt=3.14159265)
    gravity: Annotated[float, Quantity("m/s^2")] = Field(9.81, ge=0)
    process_time: Annotated[float, Quantity("s")] = Field(60.0, gt=0)
    effects: SolderEffects = SolderEffects()
    numerics: SolderNumerics = SolderNumerics()
