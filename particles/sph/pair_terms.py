"""Terms of one pair: the effect of particle j on particle i, one small function for each term.

``d`` = r_i - r_j, ``slope`` such that grad_i W = slope d, ``volume`` = m_j / rho_j, ``lightness`` = 1 / rho_i. A
momentum term returns a factor of d in the acceleration [1/s^2], a continuity term a rate of density [kg/(m^3 s)].
Multiplied by m_i momentum terms are antisymmetric, so momentum is conserved to rounding; terms along d conserve angular
momentum, too. Factors that do not depend on j are divided once, not for every pair, since divisions were half of the
cost.
"""

from numba import njit

# Share of h^2 that keeps viscous terms finite for coincident particles.
SOFTENING = 0.01
# Added to a squared distance [m^2], so that the pair of a particle with itself gives 0 instead of 0 / 0.
NOTHING = 1e-200
# Factor of the term against particle pairing in shifting (Monaghan 2000); its power is 4.
PAIRING = 0.2


@njit(cache=True, error_model="numpy")
def continuity(approach, slope, volume, density):
    """Return the continuity term rho_i (u_i - u_j) . grad W V_j, a scalar [kg/(m^3 s)].

    Args:
        approach: (u_i - u_j) . d with the vector d from j to i [m^2/s].
        slope: Kernel gradient over d, in 1/m^(dimension + 2).
        volume: Volume V_j of the neighbour.
        density: Density of particle i [kg/m^3].
    """
    return density * approach * slope * volume


@njit(cache=True, error_model="numpy")
def density_diffusion(jump, rise, slope, volume):
    """Return the density diffusion over delta h c0 (Antuono et al. 2010); it vanishes for linear densities.

    ``jump`` = rho_j - rho_i, ``rise`` = (grad rho_i + grad rho_j) . (r_j - r_i) / 2 with renormalised gradients. With
    psi = 2 (jump - rise) (r_j - r_i) / |d|^2 it is psi . grad_i W V_j, and (r_j - r_i) . d = -|d|^2.
    """
    return -2.0 * (jump - rise) * slope * volume


@njit(cache=True, error_model="numpy")
def pressure(pressure_i, pressure_j, slope, volume, lightness):
    """Return the pressure gradient term -(p_i + p_j) grad W V_j / rho_i as a factor of the vector d from j to i.

    Args:
        pressure_i: Pressure of the particle [Pa].
        pressure_j: Pressure of the neighbour [Pa].
        slope: Kernel gradient over d, in 1/m^(dimension + 2).
        volume: Volume V_j of the neighbour.
        lightness: 1 / rho_i [m^3/kg].
    """
    return -(pressure_i + pressure_j) * slope * volume * lightness


@njit(cache=True, error_model="numpy")
def artificial_viscosity(approach, distance2, slope, volume, lightness):
    """Return artificial viscosity over alpha h c0 rho_0, u.r / r^2 grad W V_j / rho_i (Antuono et al. 2012).

    Like ``pressure``, a factor of the vector d from j to i.

    Args:
        approach: (u_i - u_j) . d [m^2/s].
        distance2: Squared distance of the particles [m^2].
        slope: Kernel gradient over d, in 1/m^(dimension + 2).
        volume: Volume V_j of the neighbour.
        lightness: 1 / rho_i [m^3/kg].
    """
    return approach / (distance2 + NOTHING) * slope * volume * lightness


@njit(cache=True, error_model="numpy")
def xsph(level, mass, density_i, density_j):
    """Return the weight of u_j - u_i in the velocity that moves i, over epsilon: m_j W / rho_ij (Monaghan 1989).

    With the mean density rho_ij the velocity of the centre of mass does not change.
    """
    return 2.0 * mass * level / (density_i + density_j)


@njit(cache=True, error_model="numpy")
def shared_viscosity(viscosity_i, viscosity_j):
    """Return the viscosity of a pair, 2 mu_i mu_j / (mu_i + mu_j) (Cleary 1998), continuous in stress across a jump."""
    return 2.0 * viscosity_i * viscosity_j / (viscosity_i + viscosity_j)


@njit(cache=True, error_model="numpy")
def central_viscosity(approach, nearness, slope, volume, factor):
    """Return the Newtonian viscosity along the line of the particles (Cleary 1998); rigid rotation has none.

    ``nearness`` = 1 / (r_ij^2 + 0.01 h^2), ``factor`` = 2 (d + 2) mu / rho_i in d dimensions (Monaghan 2005); Cleary's
    4.96333 in place of d + 2 = 5 was fitted in three dimensions. On a lattice the viscosity is 6 to 20 % too small in
    shear along the axes, but not for disordered particles.
    """
    return factor * approach * nearness * slope * volume


@njit(cache=True, error_model="numpy")
def shear_viscosity(distance2, nearness, slope, volume, factor):
    """Return the Newtonian viscosity as a factor of u_i - u_j [1/s] (Morris et al. 1997).

    ``factor`` = 2 mu / rho_i. On lattices it is within 4 %. It conserves momentum, but not angular momentum at free
    surfaces.
    """
    return factor * distance2 * nearness * slope * volume


@njit(cache=True, error_model="numpy")
def crowding(level):
    """Return the factor of grad W V_j in the concentration gradient of particle shifting (Sun et al. 2017).

    ``level`` = W over its value at one spacing.
    """
    ratio2 = level * level
    return 1.0 + PAIRING * ratio2 * ratio2
