"""Registry of the particle methods for flows; loads no numerical library.

To add a method, list its functions in ``SOLVERS`` and make its numerical parameters a member of ``PlaneNumerics``.
"""

from collections.abc import Callable, Mapping
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Protocol

from reflowshock.particles.flows.flow_method import FlowNumerics
from reflowshock.particles.flows.sph_numerics import SphNumerics

if TYPE_CHECKING:
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.flows.result import FlowResult

# Numerical parameters of a plane flow by any method. A second method makes it a union with a discriminator ``method``.
PlaneNumerics = SphNumerics

# Value of ``numerics.method`` -> class of the scene -> dotted name of the function that computes the flow.
SOLVERS: Mapping[str, Mapping[str, str]] = {
    "sph": {
        "DamBreak": "reflowshock.particles.sph_flows.dam_break.solve_dam_break",
        "Poiseuille": "reflowshock.particles.sph_flows.viscous_flows.solve_poiseuille",
        "TaylorGreen": "reflowshock.particles.sph_flows.viscous_flows.solve_taylor_green",
        "Droplet": "reflowshock.particles.sph_flows.droplet.solve_droplet",
        "Printing": "reflowshock.particles.printing.printing.solve_printing",
    },
}


class HasMethod(Protocol):
    """Scene with the numerical parameters of a method."""

    @property
    def numerics(self) -> FlowNumerics:
        """Numerical parameters of the method."""


def computes(scene: HasMethod) -> bool:
    """Return whether the numerical method that a scene selects has a solver for this kind of flow.

    Args:
        scene: Parameters of a flow; its class is the kind of flow, its numerics name the method.
    """
    return type(scene).__name__ in SOLVERS[scene.numerics.method]


def solve_flow(scene: HasMethod, progress: Callable[[float], None], checkpoint: "Checkpoint") -> "FlowResult":
    """Compute a flow by the method of its scene.

    Args:
        scene: Parameters of the flow: liquid, sizes, effects and numerics.
        progress: Function called after each step with the completed fraction, 0 to 1.
        checkpoint: Checkpoint to continue from, if its file exists, and to write.

    Returns:
        Pictures, history and metrics of the flow.

    Raises:
        FloatingPointError: A position is not finite.
        KeyError: The method has no solver for this kind of flow; see ``computes``.
    """
    return resolve_name(SOLVERS[scene.numerics.method][type(scene).__name__])(scene, progress, checkpoint)
