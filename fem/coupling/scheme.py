"""Coupling schemes: their common interface, and the choice by name."""

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
    """Interface of a coupling scheme.

    Attributes:
        order: Order in which a rank creates its participants; the second waits for a message of the first.
    """

    order: tuple[Role, Role]

    def macro(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> Participant:
        """Return the participant of the macro model; collective over its ranks."""

    def meso(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> Participant:
        """Return the participant of the meso model; collective over its ranks."""


class LocalSteps:
    """Scheme with whole windows for both models; the small steps are inside the force term of the meso model."""

    def __init__(self, scheme: Scheme) -> None:
        """Wrap the scheme that couples the models at whole windows."""
        self._scheme, self.order = scheme, scheme.order

    def macro(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> Participant:
        """Return the participant of the macro model."""
        return self._scheme.macro(body, loads, replace(plan, substeps=1), channels)

    def meso(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> Participant:
        """Return the participant of the meso model."""
        return self._scheme.meso(body, loads, replace(plan, substeps=1), channels)


def scheme_of(name: SchemeName, direction: Direction = "two_way") -> Scheme:
    """Return the coupling scheme, as an object that creates the participants, of a name and direction.

    Args:
        name: ``held_velocity``, ``impulse``, ``local_steps`` or ``gravouil_combescure``.
        direction: ``two_way``, or ``one_way`` without feedback from meso to macro model; then ``impulse`` is replaced
            by the one-way scheme of held velocity.

    Returns:
        Object with a method that creates the participants (models with their motion) of a coupled run.

    Raises:
        ValueError: ``gravouil_combescure`` with ``one_way``.
    """
    if name == "gravouil_combescure":
        if direction == "one_way":
            raise ValueError("gravouil_combescure does not support direction = one_way; use held_velocity")
        return GravouilCombescure()
    if name == "impulse" and direction == "two_way":
        return Impulse()
    scheme = OneWay() if direction == "one_way" else HeldVelocity()
    return LocalSteps(scheme) if name == "local_steps" else scheme
