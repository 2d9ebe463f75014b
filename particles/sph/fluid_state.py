"""Arrays of a fluid and its walls, one a quantity, and what acts between two particles.

Particles 0 to `fluids` - 1 are liquid; the others are wall, in layers that fill the support of the liquid beside it. A
flow in a plane is one in that of x and z.
"""

from typing import NamedTuple

from reflowshock.arrays import Floats

RENORMALISED, REPRODUCING = 0, 1
GRADIENTS = {"renormalised": RENORMALISED, "reproducing": REPRODUCING}


class Law(NamedTuple):
    """What acts between two particles; a term whose coefficient is zero is not computed.

    Attributes:
        kernel: `CUBIC_SPLINE` or `WENDLAND_C2`.
        dimension: of the flow, 1 to 3.
        length: smoothing length h [m].
        norm: sigma of the kernel [1/m^d].
        rest_density: rho_0 [kg/m^3].
        sound: speed of sound c0 [m/s].
        diffusion: delta h c0 [m^2/s].
        gradient: `RENORMALISED` or `REPRODUCING`, that of the density in its diffusion.
        artificial: alpha h c0 rho_0 [Pa s].
        viscosity: mu [Pa s]; in the law of one that depends on the rate of shear, that of `Rheology`.
        rheology: `NEWTON`, `POWER_LAW` or `CARREAU`.
        exponent, shear_rate: of these laws; the rate in 1/s.
        least_viscosity, most_viscosity: bounds [Pa s], the first one Carreau's viscosity at infinity.
        has_surface: 1 where the liquid has a free one. Then viscosity acts along the line of two particles, elsewhere
            along their velocities; and walls do not pull.
        tracked: 1 where that surface is one of triangles, with a pressure of its own: then walls pull, too.
        no_slip: whether walls hold the liquid by its viscosity; 1 or 0.
        mirror: 1 where the plane z = 0 is a wall below the liquid: its particles meet their images behind it, which
            costs no particles and ends, with the liquid, at the contact line.
        spacing: of the particles at the start [m].
        xsph: epsilon of the smoothed velocity that moves particles (Monaghan 1989); 0 is none.
        shifting: share of the shift of particles by Sun et al. (2017); 0 is none.
        period_x, period_y, period_z: of a periodic flow [m]; 0 where it is not.
        gravity_x, gravity_y, gravity_z: [m/s^2].
    """

    kernel: int
    dimension: int
    length: float
    norm: float
    rest_density: float
    sound: float
    diffusion: float
    gradient: int
    artificial: float
    viscosity: float
    rheology: int
    exponent: float
    shear_rate: float
    least_viscosity: float
    most_viscosity: float
    has_surface: int
    tracked: int
    no_slip: int
    mirror: int
    spacing: float
    xsph: float
    shifting: float
    period_x: float
    period_y: float
    period_z: float
    gravity_x: float
    gravity_y: float
    gravity_z: float


class Fields(NamedTuple):
    """Quantities of n particles, as the loops read them.

    Attributes:
        x, y, z: positions [m].
        u, v, w: velocities [m/s].
        density: [kg/m^3].
        pressure: [Pa].
        mass: [kg].
        slope_x, slope_y, slope_z: renormalised gradient of the density, of the last step [kg/m^4].
        wall_u, wall_v, wall_w: velocities of the particles of walls [m/s], whose u, v, w are what viscosity sees.
        wall_room: share of the kernel about each of them that liquid fills where it covers the wall; 0 for walls that
            are layers of particles as they stand.
        wall_share: how much of each counts: the liquid that it sees over that room, at most one. So a wall of cured
            ink ends with the liquid, at the contact line, as a mirror does.
        viscosity: of each particle [Pa s]; found where it depends on the rate of shear.
    """

    x: Floats
    y: Floats
    z: Floats
    u: Floats
    v: Floats
    w: Floats
    density: Floats
    pressure: Floats
    mass: Floats
    slope_x: Floats
    slope_y: Floats
    slope_z: Floats
    wall_u: Floats
    wall_v: Floats
    wall_w: Floats
    wall_room: Floats
    wall_share: Floats
    viscosity: Floats
