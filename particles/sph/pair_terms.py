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
        approach: (u_i - u_j) . d with the vector d from j to i, scalar [m^2/s].
        slope: Kernel gradient over d, grad W = slope d, scalar in 1/m^(dimension + 2).
        volume: Volume V_j of the neighbour, scalar in m^dimension.
        density: Density of particle i, scalar [kg/m^3].
    """
    return density * approach * slope * volume


@njit(cache=True, error_model="numpy")
def density_diffusion(jump, rise, slope, volume):
    """Return the density diffusion over delta h c0 (Antuono et al. 2010), a scalar [kg/m^5]; 0 for linear densities.

    With psi = 2 (jump - rise) (r_j - r_i) / |d|^2 it is psi . grad_i W V_j, and (r_j - r_i) . d = -|d|^2.

    Args:
        jump: rho_j - rho_i, scalar [kg/m^3].
        rise: (grad rho_i + grad rho_j) . (r_j - r_i) / 2 with renormalised gradients, scalar [kg/m^3].
        slope: Kernel gradient over the vector d from j to i, scalar in 1/m^(dimension + 2).
        volume: Volume V_j of the neighbour, scalar in m^dimension.
    """
    return -2.0 * (jump - rise) * slope * volume


@njit(cache=True, error_model="numpy")
def pressure(pressure_i, pressure_j, slope, volume, lightness):
    """Return the pressure gradient term -(p_i + p_j) grad W V_j / rho_i as a factor of the vector d from j to i.

    The factor is a scalar [1/s^2]; times d it is an acceleration of particle i.

    Args:
        pressure_i: Pressure of the particle, scalar [Pa].
        pressure_j: Pressure of the neighbour, scalar [Pa].
        slope: Kernel gradient over d, grad W = slope d, scalar in 1/m^(dimension + 2).
        volume: Volume V_j of the neighbour, scalar in m^dimension.
        lightness: 1 / rho_i, scalar [m^3/kg].
    """
    return -(pressure_i + pressure_j) * slope * volume * lightness


@njit(cache=True, error_model="numpy")
def artificial_viscosity(approach, distance2, slope, volume, lightness):
    """Return artificial viscosity over alpha h c0 rho_0, u.r / r^2 grad W V_j / rho_i (Antuono et al. 2012).

    A scalar factor of the vector d from j to i; times alpha h c0 rho_0 and d it is an acceleration of particle i.

    Args:
        approach: (u_i - u_j) . d, scalar [m^2/s].
        distance2: Squared distance of the particles, scalar [m^2].
        slope: Kernel gradient over d, grad W = slope d, scalar in 1/m^(dimension + 2).
        volume: Volume V_j of the neighbour, scalar in m^dimension.
        lightness: 1 / rho_i, scalar [m^3/kg].
    """
    return approach / (distance2 + NOTHING) * slope * volume * lightness


@njit(cache=True, error_model="numpy")
def xsph(level, mass, density_i, density_j):
    """Return the weight of u_j - u_i in the velocity that moves i, over epsilon: m_j W / rho_ij (Monaghan 1989).

    The weight is a scalar without unit. With the mean density rho_ij the velocity of the centre of mass does not
    change.

    Args:
        level: Kernel W of the pair, scalar in 1/m^dimension.
        mass: Mass m_j of the neighbour, scalar in kg m^(dimension - 3).
        density_i: Density of the particle, scalar [kg/m^3].
        density_j: Density of the neighbour, scalar [kg/m^3].
    """
    return 2.0 * mass * level / (density_i + density_j)


@njit(cache=True, error_model="numpy")
def shared_viscosity(viscosity_i, viscosity_j):
    """Return the viscosity of a pair, 2 mu_i mu_j / (mu_i + mu_j) (Cleary 1998), continuous in stress across a jump.

    Args:
        viscosity_i: Viscosity mu_i of the particle, scalar [Pa s].
        viscosity_j: Viscosity mu_j of the neighbour, scalar [Pa s].
    """
    return 2.0 * viscosity_i * viscosity_j / (viscosity_i + viscosity_j)


@njit(cache=True, error_model="numpy")
def central_viscosity(approach, nearness, slope, volume, factor):
    """Return the Newtonian viscosity along the line of the particles (Cleary 1998); rigid rotation has none.

    It is a scalar factor of the vector d from j to i in the acceleration of i [1/s^2]. Cleary's 4.96333 in place of
    D + 2 = 5 in D dimensions (Monaghan 2005) was fitted in three dimensions. On a lattice the viscosity is 6 to 20 %
    too small in shear along the axes, but not for disordered particles.

    Args:
        approach: (u_i - u_j) . d, scalar [m^2/s].
        nearness: 1 / (|d|^2 + 0.01 h^2), scalar [1/m^2].
        slope: Kernel gradient over d, scalar in 1/m^(D + 2).
        volume: Volume V_j of the neighbour, scalar in m^D.
        factor: 2 (D + 2) mu / rho_i, scalar [m^2/s].
    """
    return factor * approach * nearness * slope * volume


@njit(cache=True, error_model="numpy")
def shear_viscosity(distance2, nearness, slope, volume, factor):
    """Return the Newtonian viscosity as a factor of u_i - u_j [1/s] (Morris et al. 1997).

    On lattices it is within 4 %. It conserves momentum, but not angular momentum at free surfaces.

    Args:
        distance2: Squared distance of the particles, scalar [m^2].
        nearness: 1 / (distance2 + 0.01 h^2), scalar [1/m^2].
        slope: Kernel gradient over the vector d from j to i, scalar in 1/m^(dimension + 2).
        volume: Volume V_j of the neighbour, scalar in m^dimension.
        factor: 2 mu / rho_i, scalar [m^2/s].
    """
    return factor * distance2 * nearness * slope * volume


@njit(cache=True, error_model="numpy")
def crowding(level):
    """Return the factor of grad W V_j in the concentration gradient of shifting, 1 + 0.2 level^4 (Sun et al. 2017).

    Args:
        level: W of the pair over W at a distance of one spacing, scalar without unit.
    """
    ratio2 = level * level
    return 1.0 + PAIRING * ratio2 * ratio2
