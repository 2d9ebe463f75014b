"""A rank that waits for a message sleeps, and its persistent messages can be used again."""

import threading
import time

import numpy as np
from mpi4py import MPI

from reflowshock.fem.parallel import waiting
from reflowshock.fem.parallel.waiting import wait_for, wait_for_all

TAG, WAIT = 91, 0.4


def test_a_long_wait_leaves_the_core_to_others():
    received, sent = np.zeros(3), np.arange(3.0)
    request = MPI.COMM_SELF.Irecv(received, 0, TAG)
    timer = threading.Timer(WAIT, lambda: MPI.COMM_SELF.Send(sent, 0, TAG))
    timer.start()
    begin, core = time.perf_counter(), time.process_time()
    wait_for([request])
    wall, core = time.perf_counter() - begin, time.process_time() - core
    timer.join()
    assert (received == sent).all()
    assert wall >= 0.9 * WAIT
    assert core < 0.25 * wall


def test_persistent_messages_can_be_started_again():
    received, sent = np.zeros(2), np.zeros(2)
    requests = [MPI.COMM_SELF.Recv_init(received, 0, TAG), MPI.COMM_SELF.Send_init(sent, 0, TAG)]
    for number in range(3):
        sent[:] = number, -number
        MPI.Prequest.Startall(requests)
        wait_for(requests)
        assert (received == sent).all()
    for request in requests:
        request.Free()


def test_without_messages_nothing_is_waited_for(monkeypatch):
    pauses = []
    monkeypatch.setattr(waiting, "pause", pauses.append)
    wait_for([])
    assert not pauses
    wait_for_all(MPI.COMM_SELF)


def test_pauses_grow_with_the_wait_within_limits(monkeypatch):
    pauses, yields = [], []
    monkeypatch.setattr(waiting.time, "sleep", pauses.append)
    monkeypatch.setattr(waiting.os, "sched_yield", lambda: yields.append(None))
    tests = np.geomspace(1e-6, 1.0, 200)
    for waited in tests.tolist():
        waiting.pause(waited)
    assert len(yields) == np.sum((tests > waiting.TESTING) & (tests <= waiting.YIELDING))
    assert len(pauses) == np.sum(tests > waiting.YIELDING)
    assert pauses == sorted(pauses)
    assert pauses[0] == waiting.SHORTEST_PAUSE and pauses[-1] == waiting.LONGEST_PAUSE
