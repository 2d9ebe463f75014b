"""Parameters of a reflow's temperatures that do not go with the others. Loads neither numba nor DOLFINx."""

from collections.abc import Iterator, Mapping

from reflowshock.fem.materials.parameters import Material
from reflowshock.fem.problem.thermal import Thermal
from reflowshock.problem import Problem


def problems(thermal: Thermal, materials: Mapping[str, Material], warpage: float) -> list[Problem]:
    """Find what cannot work before anything is meshed or computed.

    Args:
        thermal: The course of temperatures.
        materials: Role -> its material.
        warpage: Prescribed lift of the package's corner [m].
    """
    return [*_expansion(thermal, materials), *_warpage(thermal, warpage)]


def _expansion(thermal: Thermal, materials: Mapping[str, Material]) -> Iterator[Problem]:
    """Find materials that do not say how they expand; that of liquid solder does not matter."""
    for role, material in materials.items():
        if role == "solder" and thermal.effects.residual_stress == "off":
            continue
        for name in material.unknown_expansion:
            yield Problem(f"materials.{role}.{name}", "is missing, which [thermal] needs", None, "e.g. 16 ppm/K")


def _warpage(thermal: Thermal, warpage: float) -> Iterator[Problem]:
    if warpage and thermal.effects.flexible != "off":
        message = "does not go with [thermal], which computes the warpage"
        yield Problem("warpage.corner", message, warpage, "0 mm, or thermal.effects.flexible = off")
