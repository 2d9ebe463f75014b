"""Recording and replay of interface messages: one side of a coupled run alone, to the same bits.

A participant takes its channels at the start and has no other connection to its partner; the received messages are
therefore sufficient. Messages that it sends are compared with the recorded ones.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.parallel.exchange import InterfaceChannels, MessageClock, Messages

CHANNELS, WAYS = ("velocities", "forces"), ("sent", "received")


class RecordingError(ValueError):
    """Recorded messages that do not fit the participant."""


@dataclass(slots=True)
class Recorded:
    """Channel that records its messages.

    Attributes:
        channel: Channel.
        rows: Local interface nodes of the participant.
        sent: Values at them, shape (k, 3), message by message; ``received`` likewise.
    """

    channel: Messages
    rows: NDArray[np.int32]
    sent: list[NDArray[np.float64]] = field(default_factory=list)
    received: list[NDArray[np.float64]] = field(default_factory=list)

    @property
    def clock(self) -> MessageClock:
        """Clock of the channel."""
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
    """Channel that replays received messages.

    Attributes:
        rows: Local interface nodes of the participant.
        sent: Values of the recorded messages, shape (w, k, 3); ``received`` likewise.
        deviation: Largest difference between sent and recorded values.
    """

    rows: NDArray[np.int32]
    sent: NDArray[np.float64]
    received: NDArray[np.float64]
    deviation: float = 0.0
    clock: MessageClock = field(default_factory=MessageClock)
    _given: int = 0
    _taken: int = 0

    def send(self, values: NDArray[np.float64]) -> None:
        """Compare with the next recorded message."""
        difference = values[self.rows] - self._next(self.sent, self._taken)
        self.deviation = max(self.deviation, float(np.abs(difference).max(initial=0.0)))
        self._taken += 1

    def receive(self, values: NDArray[np.float64]) -> None:
        """Return the next received message."""
        values[self.rows] = self._next(self.received, self._given)
        self._given += 1

    def free(self) -> None:
        """Do nothing."""

    @staticmethod
    def _next(messages: NDArray[np.float64], number: int) -> NDArray[np.float64]:
        if number >= len(messages):
            raise RecordingError(f"the recording has {len(messages)} messages, the participant asks for another one")
        return messages[number]


def record(channels: InterfaceChannels, rows: NDArray[np.int32]) -> InterfaceChannels:
    """Return channels that pass on the messages of a participant and record them.

    Args:
        channels: Channels of velocities and forces between the models.
        rows: Local numbers of the participant's interface nodes, shape (k,).
    """
    return InterfaceChannels(Recorded(channels.velocities, rows), Recorded(channels.forces, rows))


def save_recording(channels: InterfaceChannels, path: Path) -> None:
    """Write the messages that channels of ``record`` have recorded to an NPZ file."""
    arrays = {}
    for name in CHANNELS:
        channel = getattr(channels, name)
        for way in WAYS:
            arrays[f"{name}_{way}"] = np.array(getattr(channel, way)).reshape(-1, len(channel.rows), 3)
    np.savez(path, **arrays)


def replay(path: Path, rows: NDArray[np.int32]) -> InterfaceChannels:
    """Return channels that replay recorded messages to a participant with the same interface nodes.

    Args:
        path: File of ``save_recording``.
        rows: Local numbers of the participant's interface nodes, shape (k,).

    Raises:
        RecordingError: If the recording is of another interface.
    """
    with np.load(path) as arrays:
        sent, received = ({name: arrays[f"{name}_{way}"] for name in CHANNELS} for way in WAYS)
    count = sent["forces"].shape[1]
    if count != len(rows):
        raise RecordingError(f"{path} is of an interface of {count} nodes, this one has {len(rows)}")
    velocities, forces = (Replayed(rows, sent[name], received[name]) for name in CHANNELS)
    return InterfaceChannels(velocities, forces)
