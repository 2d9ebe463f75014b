"""Slowness of this machine: time of an element update over that of the reference machine of the forecasts.

It is measured in a few seconds after the first long shock, when the kernels are compiled, and kept in their folder. A
measurement beside other work is repeated after the next long shock.
"""

import json
import os
import subprocess
import sys
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import date
from math import exp, log
from statistics import fmean

from reflowshock.workflow.process.kernel_folder import kernel_folder
from reflowshock.workflow.process.rank_count import core_times, idle_between

FILE = "speed.json"
LONG = 60.0  # shortest predicted stage after which the machine is measured [s]
IDLE = 0.25  # cores that others may use during a measurement
PATIENCE = 300.0  # [s] for a measurement, most of it for kernels that a case did not need
UNMEASURED = "Steps are assumed to be as fast as on the reference machine; this machine is measured after a long shock."


@dataclass(frozen=True, slots=True)
class MachineSpeed:
    """Measured slowness of this machine.

    Attributes:
        slowness: Time of an element update over that of the reference machine (above 1: slower), geometric mean of the
            element families.
        families: The same ratio of each element family, by name.
        date: Day of the measurement, ISO format.
        busy: Mean number of cores of this process that other programs used during the measurement.
    """

    slowness: float
    families: dict[str, float]
    date: str
    busy: float

    def in_words(self) -> str:
        """Return what forecasts assume of this machine, as a sentence."""
        load = f", beside other work on {self.busy:.1f} cores" if self.busy > IDLE else ""
        return (
            f"Steps take {self.slowness:.2g} times as long as on the reference machine, measured on {self.date}{load}."
        )


def machine_speed() -> MachineSpeed | None:
    """Return the measured slowness of this machine, from its file in the folder of compiled kernels.

    Returns:
        Mean slowness (time of an element update over the time of the reference machine), slowness of each element
        family, day of the measurement, and number of cores that other programs used; None before the first measurement,
        or if the file is damaged.
    """
    folder = kernel_folder()
    with suppress(OSError, ValueError, TypeError):
        if folder is not None:
            return MachineSpeed(**json.loads((folder / FILE).read_text(encoding="utf-8")))
    return None


def slowness() -> float:
    """Return the time of an element update on this machine over that on the reference machine.

    It is one if the machine is not yet measured; above one the machine is slower.
    """
    speed = machine_speed()
    return 1.0 if speed is None else speed.slowness


def measure_after(predicted: float) -> None:
    """Measure the slowness of this machine after a shock and store it in a file; takes up to five minutes.

    Nothing is measured after a shock predicted below ``LONG`` (60 s), without a folder for the file, or if there
    already is a measurement during which other programs used at most ``IDLE`` (0.25) cores. If the measurement fails,
    the earlier file stays, and no error is raised.

    Args:
        predicted: Predicted wall time of the shock without compilation [s].
    """
    former, folder = machine_speed(), kernel_folder()
    if predicted < LONG or folder is None or (former is not None and former.busy <= IDLE):
        return
    before, allowed = core_times(), os.sched_getaffinity(0)
    command = [sys.executable, "-m", "reflowshock.fem.run.calibrate"]
    with suppress(OSError, ValueError, subprocess.SubprocessError):  # without it, forecasts stay those of the reference
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=True)
        families = json.loads(done.stdout)
        busy = len(allowed) - idle_between(before, core_times(), allowed) - 1.0
        mean = exp(fmean(log(value) for value in families.values()))
        speed = MachineSpeed(mean, families, date.today().isoformat(), max(busy, 0.0))
        (folder / FILE).write_text(json.dumps(asdict(speed), indent=1) + "\n", encoding="utf-8")
