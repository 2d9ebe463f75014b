"""The participants of a coupled run on one rank, and the channels between them."""

from collections.abc import Mapping

import numpy as np

from fem.body import Body
from fem.communicators import Communicators, Role
from fem.coupling.scheme import Scheme
from fem.estimate import WindowPlan
from fem.exchange import CutChannels, MessageClock
from fem.loads import Load
from fem.participant import Participant


def couple(
    comms: Communicators,
    bodies: Mapping[Role, Body],
    loads: Mapping[Role, list[Load]],
    plan: WindowPlan,
    scheme: Scheme,
) -> tuple[dict[Role, Participant], list[MessageClock]]:
    """Return the participants of this rank, in the order of their turns, and the clocks of channels; collective.

    Args:
        comms: The communicators of both models.
        bodies: The models of this rank.
        loads: What acts on each of them.
        plan: Windows and substeps.
        scheme: How they are coupled.
    """
    absent = np.full_like(next(iter(bodies.values())).cut, -1)
    macro, meso = (bodies[role].cut if role in bodies else absent for role in ("macro", "meso"))
    channels = CutChannels.open(comms.world, macro, meso, receiver_waits=len(comms.models) == 1)
    make = {"macro": scheme.macro, "meso": scheme.meso}
    made = {role: make[role](bodies[role], loads[role], plan, channels) for role in scheme.order if role in bodies}
    return {role: made[role] for role in comms.models}, channels.clocks
