"""Fields of a fluid and its walls, one array for each quantity, and parameters of the pair interactions.

Particles 0 to ``fluids`` - 1 are liquid; the others are wall particles, in layers that fill the support of the liquid
near the wall. A flow in a plane is in the plane of x and z.
"""

from typing import NamedTuple

from reflowshock.arrays import Floats

RENORMALISED, REPRODUCING = 0, 1
GRADIENTS = {"renormalised": RENORMALISED, "reproducing": REPRODUCING}


class Law(NamedTuple):
    """Parameters of the interaction of two particles; a term whose coefficient is zero does not act.

    Attributes:
        kernel: Smoothing kernel, ``CUBIC_SPLINE`` or ``WENDLAND_C2``.
        dimension: Dimension d of the flow, 1 to 3.
        length: Smoothing length h [m].
        norm: Normalisation sigma of the kernel [1/m^d].
        rest_density: Density at rest rho_0 [kg/m^3].
        sound: Speed of sound c0 [m/s].
        diffusion: Coefficient of density diffusion, delta h c0 [m^2/s].
        gradient: Density gradient in the diffusion, ``RENORMALISED`` (3 x 3) or ``REPRODUCING`` (4 x 4, exact for
            linear densities at surfaces, too).
        artificial: Artificial viscosity, alpha h c0 rho_0 [Pa s].
        viscosity: Viscosity mu [Pa s]; with a shear-dependent law the one named in ``Rheology``.
        rheology: Viscosity law, ``NEWTON``, ``POWER_LAW`` or ``CARREAU``.
        exponent: Exponent of the viscosity law.
        shear_rate: Reference shear rate of the viscosity law [1/s].
        least_viscosity: Lower bound of the viscosity [Pa s]; Carreau's viscosity at infinite rate.
        most_viscosity: Upper bound of the viscosity [Pa s].
        has_surface: 1 with a free surface: viscosity acts along the line of two particles, which conserves angular
            momentum, and walls do not pull. 0 otherwise: viscosity acts along relative velocities.
        tracked: 1 if the free surface is a tracked one of triangles, whose pressure lets walls pull, too.
        no_slip: 1 if walls act on the liquid by viscosity, else 0.
        mirror: 1 if the plane z = 0 is a wall with mirror images of the particles. Images need no memory and end, with
            the liquid, at the contact line, where layers of wall particles would press on the liquid.
        spacing: Initial particle spacing [m].
        xsph: Factor epsilon of the smoothed velocity that moves particles (Monaghan 1989); 0 for none.
        shifting: Share of the particle shift of Sun et al. (2017); 0 for none.
        period_x: Period along x [m]; 0 if not periodic.
        period_y: Period along y [m].
        period_z: Period along z [m].
        gravity_x: Gravity along x [m/s^2].
        gravity_y: Gravity along y [m/s^2].
        gravity_z: Gravity along z [m/s^2].
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
    """Fields of n particles, m of which are wall particles.

    Attributes:
        x: Positions along x, shape (n,) [m]; likewise y, z.
        u: Velocities along x, shape (n,) [m/s]; likewise v, w. Those of wall particles are extrapolated for viscosity.
        density: Densities, shape (n,) [kg/m^3].
        pressure: Pressures, shape (n,) [Pa].
        mass: Masses, shape (n,) [kg].
        slope_x: Density gradient of the last step along x, shape (n,) [kg/m^4]; likewise slope_y, slope_z.
        wall_u: Velocities of wall particles along x, shape (m,) [m/s]; likewise wall_v, wall_w.
        wall_room: Share of the kernel about each wall particle that liquid fills when it covers the wall, shape (m,); 0
            for walls that always count fully.
        wall_share: Weight of each wall particle, shape (m,): the liquid within its kernel over ``wall_room``, at most
            one.
            So a wall of cured ink ends with the liquid at the contact line, as a mirror does.
        viscosity: Viscosities, shape (n,) [Pa s]; computed if they depend on the shear rate.
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
