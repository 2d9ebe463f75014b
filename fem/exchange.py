"""Messages between ranks: sums over nodes that several ranks hold, and the channel across the cut."""

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fem.kernels_motion import pack, sum_in_rank_order, unpack

SHARED_TAG, CHANNEL_TAG = 11, 12


def holders(comm: MPI.Comm, nodes: NDArray[np.integer]) -> list[NDArray[np.int64]]:
    """Find which nodes this rank shares with which other rank.

    Each node number has a home rank (number modulo size) where its holders meet: no rank ever sees all nodes.

    Args:
        comm: Communicator of the model.
        nodes: ``(n,)`` node numbers of this rank, each once.

    Returns:
        Per rank the shared node numbers, ascending; empty for this rank itself.
    """
    nodes = np.sort(np.asarray(nodes, np.int64))
    arrived = comm.alltoall([nodes[nodes % comm.size == home] for home in range(comm.size)])
    number = np.concatenate(arrived)
    rank = np.repeat(np.arange(comm.size), [len(part) for part in arrived])
    order = np.lexsort((rank, number))
    number, rank = number[order], rank[order]
    pairs = [np.empty((0, 3), np.int64)]
    for distance in range(1, min(comm.size, len(number))):  # holders of a node are neighbours in the sorted table
        same = np.flatnonzero(number[distance:] == number[:-distance])
        pairs.append(np.column_stack([number[same], rank[same], rank[same + distance]]))
        pairs.append(np.column_stack([number[same], rank[same + distance], rank[same]]))
    table = np.concatenate(pairs)
    shared = np.concatenate(comm.alltoall([table[table[:, 1] == holder][:, [0, 2]] for holder in range(comm.size)]))
    return [np.sort(shared[shared[:, 1] == other, 0]) for other in range(comm.size)]


class SharedNodes:
    """Sums over the copies of nodes that several ranks hold: one message per neighbour, buffers kept.

    Attributes:
        owned: ``(n,)``: whether this rank is the lowest that holds the node.
    """

    def __init__(self, comm: MPI.Comm, nodes: NDArray[np.integer]) -> None:
        """Find the copies of the nodes ``(n,)`` of this rank, and prepare the messages."""
        shared = holders(comm, nodes)
        order = np.argsort(nodes)
        local = [order[np.searchsorted(nodes, numbers, sorter=order)].astype(np.int32) for numbers in shared]
        self.owned = np.ones(len(nodes), dtype=bool)
        for other in range(comm.rank):
            self.owned[local[other]] = False
        self._rows = np.concatenate(local)
        self._sent, self._received = np.empty((len(self._rows), 3)), np.empty((len(self._rows), 3))
        self._requests = []
        start = 0
        for other, rows in enumerate(local):
            part = slice(start, start + len(rows))
            start += len(rows)
            if len(rows):
                self._requests.append(comm.Recv_init(self._received[part], other, SHARED_TAG))
                self._requests.append(comm.Send_init(self._sent[part], other, SHARED_TAG))
        ranks = np.repeat(np.arange(comm.size), [len(rows) for rows in local])
        self._nodes, self._pointer, self._source = rank_order(self._rows, ranks, comm.rank)

    def add(self, values: NDArray[np.float64]) -> None:
        """Replace shared rows of ``values (n, 3)`` by the sum over all ranks that hold them."""
        if self._requests:
            pack(values, self._rows, self._sent)
            MPI.Prequest.Startall(self._requests)
            MPI.Prequest.Waitall(self._requests)
            sum_in_rank_order(self._nodes, self._pointer, self._source, self._received, values)

    def free(self) -> None:
        """Free the persistent requests."""
        for request in self._requests:
            request.Free()
        self._requests = []


def rank_order(
    rows: NDArray[np.int32], ranks: NDArray[np.int64], own: int
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Order the received parts of each shared node by rank, this rank's own part among them.

    Args:
        rows: ``(k,)`` local node of each received row.
        ranks: ``(k,)`` rank that sends it.
        own: This rank.

    Returns:
        Nodes ``(m,)``, pointer ``(m + 1,)`` and sources of ``kernels_motion.sum_in_rank_order``.
    """
    nodes = np.unique(rows)
    node = np.concatenate([rows, nodes])
    rank = np.concatenate([ranks, np.full(len(nodes), own)])
    source = np.concatenate([np.arange(len(rows)), np.full(len(nodes), -1)])
    order = np.lexsort((rank, node))
    pointer = np.concatenate([[0], np.cumsum(np.bincount(np.searchsorted(nodes, node), minlength=len(nodes)))])
    return nodes.astype(np.int32), pointer.astype(np.int32), source[order].astype(np.int32)


@dataclass(frozen=True, slots=True)
class Port:
    """What one rank knows about the cut: local node ``(k,)`` of each cut node, -1 where it has none."""

    local: NDArray[np.int32]
    sends: bool


class Channel:
    """One-way messages of cut values ``(., 3)`` from the ranks of one model to those of the other.

    The lowest sending rank that holds a cut node sends it to every receiving rank that holds it.
    """

    def __init__(self, comm: MPI.Comm, port: Port) -> None:
        """Agree on who sends what; collective over both models."""
        ports: list[Port] = comm.allgather(port)
        held = np.array([item.local >= 0 for item in ports]).reshape(comm.size, -1)
        sends = np.array([item.sends for item in ports])
        sender = np.argmax(held & sends[:, None], axis=0)
        parts = []
        for other in range(comm.size):
            source, target = (comm.rank, other) if port.sends else (other, comm.rank)
            if sends[source] and not sends[target]:
                cut = np.flatnonzero((sender == source) & held[source] & held[target])
                if len(cut):
                    parts.append((other, port.local[cut]))
        self._rows = np.concatenate([rows for _, rows in parts] or [np.empty(0, np.int32)])
        self._buffer = np.empty((len(self._rows), 3))
        start = comm.Send_init if port.sends else comm.Recv_init
        ends = np.cumsum([len(rows) for _, rows in parts])
        self._requests = [
            start(self._buffer[end - len(rows) : end], other, CHANNEL_TAG) for (other, rows), end in zip(parts, ends)
        ]

    def send(self, values: NDArray[np.float64]) -> None:
        """Send the cut rows of ``values (n, 3)``; the receiver waits for them, so this returns at once."""
        pack(values, self._rows, self._buffer)
        MPI.Prequest.Startall(self._requests)
        MPI.Prequest.Waitall(self._requests)

    def receive(self, values: NDArray[np.float64]) -> None:
        """Receive the cut rows of ``values (n, 3)``."""
        MPI.Prequest.Startall(self._requests)
        MPI.Prequest.Waitall(self._requests)
        unpack(self._buffer, self._rows, values)

    def free(self) -> None:
        """Free the persistent requests."""
        for request in self._requests:
            request.Free()
        self._requests = []
