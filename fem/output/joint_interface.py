"""Von Mises stress at the upper interface of all joints at chosen times (``interface.npz``)."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.data_file import columns, rows
from reflowshock.fem.dynamics.participant import Participant
from reflowshock.fem.elements.stress import von_mises
from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.mesh.joint_interface import JointInterfaceTable
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.stress_recovery import StressRecovery
from reflowshock.fem.parallel.checkpoint_state import Log, State
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.parallel.rank_activity import ACTIVITY
from reflowshock.fem.parallel.waiting import wait_for_all


def picture_windows(times: Iterable[float], plan: WindowPlan) -> frozenset[int]:
    """Return the numbers of the windows whose ends are closest to some times [s].

    A window is the time between two exchanges of macro and meso model, or a step of a single model; 0 is the start.

    Args:
        times: Times of pictures [s]; times after the last window are skipped.
        plan: Size and number of the windows.
    """
    windows = (round(time / plan.window) for time in times)
    return frozenset(window for window in windows if window <= plan.windows)


class JointInterfaceStress:
    """Snapshots of the von Mises stress of the solder elements at the package pads; implements ``Pictures``.

    Attributes:
        windows: Windows at whose ends a snapshot is taken.
    """

    def __init__(
        self, world: MPI.Comm, tables: Mapping[Role, tuple[JointInterfaceTable, Body]], windows: frozenset[int]
    ) -> None:
        """Select this rank's elements from the interface tables of its models."""
        self.windows, self._world = windows, world
        self._table = next(iter(tables.values()))[0]
        self._shares: dict[Role, tuple[NDArray[np.intp], StressRecovery]] = {}
        for role, (table, body) in tables.items():
            cells = body.local.locate_cells(table.cells)
            is_local = np.flatnonzero(cells >= 0)
            self._shares[role] = is_local, StressRecovery(body, cells[is_local])
        self._rows: list[dict[str, Any]] = []

    def sample(self, participants: Mapping[Role, Participant]) -> None:
        """Take a snapshot of the stress; collective over all models."""
        stress = np.zeros(len(self._table.cells))
        for role, participant in participants.items():
            motion, (rows, recovery) = participant.motion, self._shares[role]
            stress[rows] = von_mises(recovery.stress(motion.displacement - motion.base_displacement()))
            time = motion.time
        ACTIVITY.wait_for("the stress at the interface of joints, with all ranks")
        wait_for_all(self._world)
        self._world.Allreduce(MPI.IN_PLACE, stress)
        ACTIVITY.go_on()
        if self._world.rank == 0:
            self._rows.append({"time": time, "stress": stress})

    def state(self) -> State:
        """Return the snapshots so far, for a checkpoint."""
        return {"rows": Log(columns(self._rows))}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore the values that ``state`` returned."""
        self._rows = rows(state["rows"])

    def write(self, directory: Path) -> None:
        """Write times (k,) [s], joint surfaces and ``von_mises@<joint>``, shape (k, m) [Pa], on rank 0."""
        if self._world.rank:
            return
        table, count = self._table, len(self._rows)
        stress = np.array([row["stress"] for row in self._rows]).reshape(count, len(table.cells))
        by_joint = {f"von_mises@{name}": stress[:, table.joint == k] for k, name in enumerate(table.joints)}
        times = np.array([row["time"] for row in self._rows])
        np.savez(directory / "interface.npz", times=times, **table.surfaces(), **by_joint)
