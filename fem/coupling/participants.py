"""Participants of a coupled run on one rank, and the channels between them."""

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
    """Participants of this rank in the order of their turns, clocks of their channels, and the self-check."""

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
    """Open the channels of a coupled run, run the self-check, and create the participants; collective.

    Args:
        comms: Communicators of both models.
        bodies: Models of this rank, ``macro``, ``meso`` or both.
        loads: Loads and damping of each model.
        plan: Windows (times between two exchanges of the models) and substeps.
        scheme: Coupling scheme.

    Returns:
        Models of this rank with their motion, in the order of their turns, clocks of the channels, and the self-check.

    Raises:
        AgreedError: The self-check failed; on every rank.
    """
    absent = np.full_like(next(iter(bodies.values())).interface, -1)
    macro, meso = (bodies[role].interface if role in bodies else absent for role in ("macro", "meso"))
    channels = InterfaceChannels.open(comms.world, macro, meso, receiver_waits=len(comms.models) == 1)
    checked = self_check(comms.world, bodies, channels)
    checked.judge()
    if comms.world.rank == 0:
        print(checked.words, flush=True)
    make = {"macro": scheme.macro, "meso": scheme.meso}
    participants = {
        role: make[role](bodies[role], loads[role], plan, channels) for role in scheme.order if role in bodies
    }
    return CoupledRun({role: participants[role] for role in comms.models}, channels.clocks, checked)
