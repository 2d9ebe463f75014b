"""Coupling schemes: the contract, and the scheme of a name."""

from dataclasses import replace
from typing import Literal, Protocol

from reflowshock.fem.coupling.gravouil_combescure import GravouilCombescure
from reflowshock.fem.coupling.held_velocity import HeldVelocity
from reflowshock.fem.coupling.impulse import Impulse
from reflowshock.fem.coupling.one_way import OneWay
from reflowshock.fem.division.division import SchemeName
from reflowshock.fem.dynamics.participant import Participant
from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.loads.load import Load
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.parallel.exchange import InterfaceChannels

Direction = Literal["two_way", "one_way"]


class Scheme(Protocol):
    """How two models go through a window together.

    Attributes:
        order: In which order a rank makes its participants: the second waits for what the first sends.
    """

    order: tuple[Role, Role]

    def macro(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> Participant:
        """Return the macro model's participant; collective over its ranks."""

    def meso(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> Participant:
        """Return the meso model's participant; collective over its ranks."""


class LocalSteps:
    """Another scheme both of whose models take whole windows: the smaller steps are inside the meso model's force."""

    def __init__(self, scheme: Scheme) -> None:
        """Take the scheme that couples at whole windows."""
        self._scheme, self.order = scheme, scheme.order

    def macro(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> Participant:
        """Return the macro model's participant."""
        return self._scheme.macro(body, loads, replace(plan, substeps=1), channels)

    def meso(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> Participant:
        """Return the meso model's participant."""
        return self._scheme.meso(body, loads, replace(plan, substeps=1), channels)


def scheme_of(name: SchemeName, direction: Direction = "two_way") -> Scheme:
    """Return the scheme of a name and direction.

    Raises:
        ValueError: The scheme needs an answer, which one way does not give.
    """
    if name == "gravouil_combescure":
        if direction == "one_way":
            raise ValueError("gravouil_combescure links two models; one_way needs held_velocity")
        return GravouilCombescure()
    if name == "impulse" and direction == "two_way":
        return Impulse()
    scheme = OneWay() if direction == "one_way" else HeldVelocity()
    return LocalSteps(scheme) if name == "local_steps" else scheme
