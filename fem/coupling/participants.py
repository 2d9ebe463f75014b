"""The participants of a coupled run on one rank, and the channels between them."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from reflowshock.fem.coupling.scheme import Scheme
from reflowshock.fem.coupling.self_check import SelfCheck, self_check
from reflowshock.fem.dynamics.participant import Participant
from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.loads.load import Load
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.parallel.exchange import InterfaceChannels, MessageClock


class CoupledRun(NamedTuple):
    """Participants of this rank in the order of their turns, clocks of their channels, what was checked before."""

    participants: dict[Role, Participant]
    clocks: list[MessageClock]
    checked: SelfCheck | None = None


def couple(
    comms: Communicators,
    bodies: Mapping[Role, Body],
    loads: Mapping[Role, list[Load]],
    plan: WindowPlan,
    scheme: Scheme,
) -> "CoupledRun":
    """Open the channels of a coupled run, check what must be exact, and make the participants; collective.

    Args:
        comms: The communicators of both models.
        bodies: The models of this rank.
        loads: What acts on each of them.
        plan: Windows and substeps.
        scheme: How they are coupled.

    Raises:
        AgreedError: Fields, forces or masses that are not exact; on every rank.
    """
    absent = np.full_like(next(iter(bodies.values())).interface, -1)
    macro, meso = (bodies[role].interface if role in bodies else absent for role in ("macro", "meso"))
    channels = InterfaceChannels.open(comms.world, macro, meso, receiver_waits=len(comms.models) == 1)
    checked = self_check(comms.world, bodies, channels)
    checked.judge()
    if comms.world.rank == 0:
        print(checked.words, flush=True)
    make = {"macro": scheme.macro, "meso": scheme.meso}
    made = {role: make[role](bodies[role], loads[role], plan, channels) for role in scheme.order if role in bodies}
    return CoupledRun({role: made[role] for role in comms.models}, channels.clocks, checked)
