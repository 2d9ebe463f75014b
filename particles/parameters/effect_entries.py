"""The effects of a reflow as plain data: what each adds, when it matters, where it lives, how it is switched."""

from typing import Any

from reflowshock.particles.parameters.effects import (
    LARGEST_BOND,
    NEGLIGIBLE_SHAPE_CHANGE,
    PROCESS_TIME_RATIO,
    SHAPE_CHANGE_BY_BOND,
)

ENTRIES: tuple[dict[str, Any], ...] = (
    {
        "name": "gravity",
        "adds": "f = -rho g z dV/dx on the free surface",
        "number": f"{SHAPE_CHANGE_BY_BOND:g} Bo, Bo = rho g L H / gamma",
        "threshold": NEGLIGIBLE_SHAPE_CHANGE,
        "influence": f"{SHAPE_CHANGE_BY_BOND:g} Bo of the shape, up to (large contact angles)",
        "place": "reflowshock.particles.physics.force_gravity.Gravity",
        "switch": "solder.effects.gravity (of a scene: gravity) = auto, on, off",
        "source": "Bashforth & Adams 1883, heights of sessile drops",
    },
    {
        "name": "inertia",
        "adds": "rho Dv/Dt",
        "number": "T / max(sqrt(rho L^3 / gamma), rho L^2 / (5 mu)), process over slowest time",
        "threshold": PROCESS_TIME_RATIO,
        "acts": "below",
        "influence": "exp(-T / slowest time): what is left of the motion",
        "place": "reflowshock.particles.physics.mass.Inertia",
        "switch": "solder.effects.inertia = auto, on, off",
        "source": "Lamb 1932, art. 355, decay of mode 2",
    },
    {
        "name": "viscosity",
        "adds": "-div(2 mu D(v))",
        "number": "as inertia; Oh = mu / sqrt(rho gamma L) is told",
        "threshold": PROCESS_TIME_RATIO,
        "acts": "below",
        "influence": "exp(-T / slowest time): at rest it does nothing",
        "place": "reflowshock.particles.physics.viscosity.Viscosity",
        "switch": "solder.effects.viscosity = auto, on, off",
        "source": "Lamb 1932, art. 355",
    },
    {
        "name": "surface_tension",
        "adds": "f = -gamma dA/dx, implicit: dt gamma K v",
        "number": "Bo = rho g L H / gamma",
        "threshold": LARGEST_BOND,
        "acts": "below",
        "influence": "1 / sqrt(1 + Bo) of the shape: the capillary length over the size",
        "place": "reflowshock.particles.physics.force_surface_tension.SurfaceTension",
        "switch": "solder.effects.surface_tension = auto, on, off",
        "source": "de Gennes, Brochard-Wyart & Quere 2004, 2.1",
    },
    {
        "name": "wall_adhesion",
        "adds": "f = gamma cos(theta) dA_wet/dx, contact lines that edges pin",
        "number": "Bo = rho g L H / gamma",
        "threshold": LARGEST_BOND,
        "acts": "below",
        "influence": "1 / sqrt(1 + Bo) of the shape, unless theta = 90 deg",
        "place": "reflowshock.particles.physics.force_wetting.Wetting",
        "switch": "solder.effects.wall_adhesion = auto, on, off",
        "source": "Young 1805; Brakke 1992",
    },
)
