"""The machine that costs were measured on."""

import platform
from dataclasses import dataclass
from pathlib import Path

from reflowshock.workflow.process.environment import available_cores

CPU_INFO = Path("/proc/cpuinfo")


@dataclass(frozen=True, slots=True)
class Machine:
    """Model of the processor, and the cores that a program may use."""

    processor: str
    cores: int

    def __str__(self) -> str:
        return f"{self.processor}, {self.cores} {'core' if self.cores == 1 else 'cores'}"


def this_machine() -> Machine:
    """Return the machine that this process is on."""
    return Machine(_model() or platform.processor() or platform.machine(), available_cores())


def _model() -> str:
    if not CPU_INFO.is_file():
        return ""
    lines = (line.partition(":") for line in CPU_INFO.read_text(encoding="utf-8").splitlines())
    return next((value.strip() for key, _, value in lines if key.strip() == "model name"), "")
