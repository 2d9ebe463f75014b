"""Messages across the interface written down, and given again: one side of a coupled run alone, to the same bits.

A participant of any scheme takes its channels at the start and knows nothing else of its partner, so that what it
received is all that it needs. What it sends again is compared with what it sent.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.parallel.exchange import InterfaceChannels, MessageClock, Messages

CHANNELS, WAYS = ("velocities", "forces"), ("sent", "received")


class RecordingError(ValueError):
    """Recorded messages that do not fit the participant that wants them."""


@dataclass(slots=True)
class Recorded:
    """A channel whose messages are written down.

    Attributes:
        channel: The channel.
        rows: Local interface nodes of the participant.
        sent: Values ``(k, 3)`` at them, message by message; ``received`` as well.
    """

    channel: Messages
    rows: NDArray[np.int32]
    sent: list[NDArray[np.float64]] = field(default_factory=list)
    received: list[NDArray[np.float64]] = field(default_factory=list)

    @property
    def clock(self) -> MessageClock:
        """Return the clock of the channel."""
        return self.channel.clock

    def send(self, values: NDArray[np.float64]) -> None:
        """Send."""
        self.sent.append(values[self.rows])
        self.channel.send(values)

    def receive(self, values: NDArray[np.float64]) -> None:
        """Receive."""
        self.channel.receive(values)
        self.received.append(values[self.rows])

    def free(self) -> None:
        """Free the channel."""
        self.channel.free()


@dataclass(slots=True)
class Replayed:
    """A channel that gives what was received once.

    Attributes:
        rows: Local interface nodes of the participant.
        sent: Values ``(w, k, 3)`` of the recorded messages, and ``received``.
        deviation: Largest difference of what is sent now from what was sent then.
    """

    rows: NDArray[np.int32]
    sent: NDArray[np.float64]
    received: NDArray[np.float64]
    deviation: float = 0.0
    clock: MessageClock = field(default_factory=MessageClock)
    _given: int = 0
    _taken: int = 0

    def send(self, values: NDArray[np.float64]) -> None:
        """Compare with the next message that was sent."""
        difference = values[self.rows] - self._next(self.sent, self._taken)
        self.deviation = max(self.deviation, float(np.abs(difference).max(initial=0.0)))
        self._taken += 1

    def receive(self, values: NDArray[np.float64]) -> None:
        """Take the next message that was received."""
        values[self.rows] = self._next(self.received, self._given)
        self._given += 1

    def free(self) -> None:
        """Do nothing."""

    @staticmethod
    def _next(messages: NDArray[np.float64], number: int) -> NDArray[np.float64]:
        if number >= len(messages):
            raise RecordingError(f"the recording has {len(messages)} messages, another one is wanted")
        return messages[number]


def record(channels: InterfaceChannels, rows: NDArray[np.int32]) -> InterfaceChannels:
    """Return channels of a participant that record what goes through them; ``rows`` are its local interface nodes."""
    return InterfaceChannels(Recorded(channels.velocities, rows), Recorded(channels.forces, rows))


def save_recording(channels: InterfaceChannels, path: Path) -> None:
    """Write what channels of ``record`` have written down (``.npz``)."""
    arrays = {}
    for name in CHANNELS:
        channel = getattr(channels, name)
        for way in WAYS:
            arrays[f"{name}_{way}"] = np.array(getattr(channel, way)).reshape(-1, len(channel.rows), 3)
    np.savez(path, **arrays)


def replay(path: Path, rows: NDArray[np.int32]) -> InterfaceChannels:
    """Return channels that give again what a participant with the same interface nodes received.

    Raises:
        RecordingError: The recording is of another interface.
    """
    with np.load(path) as arrays:
        sent, received = ({name: arrays[f"{name}_{way}"] for name in CHANNELS} for way in WAYS)
    count = sent["forces"].shape[1]
    if count != len(rows):
        raise RecordingError(f"{path} is of an interface of {count} nodes, this one has {len(rows)}")
    velocities, forces = (Replayed(rows, sent[name], received[name]) for name in CHANNELS)
    return InterfaceChannels(velocities, forces)
