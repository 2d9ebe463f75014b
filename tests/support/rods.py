"""Trial for tests of the collector, also a pytest plugin that registers rods as a trial."""

import math
import os
import time
from typing import Annotated

from pydantic import Field

from reflowshock.cases.hard.draws import DRAWS, quantities, tables
from reflowshock.cases.hard.trial import Measured, Refused, Trial, trials
from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity


class Rod(Parameters):
    """Rod under tension."""

    length: Annotated[float, Quantity("mm")] = Field(gt=0)
    fate: str = "holds"


def stretch(rod: Rod) -> dict[str, Measured]:
    """Return the metrics ``error`` and ``width`` of a rod, or raise an error, hang or die as its fate requires."""
    if rod.fate == "hangs":
        time.sleep(60.0)
    if rod.fate == "dies":
        os._exit(3)
    if rod.fate == "raises":
        raise ArithmeticError("the rod broke")
    if rod.fate == "is refused":
        raise Refused("no such rod")
    error = math.nan if rod.fate == "is lost" else -2e-3
    return {"error": Measured(100.0 * error, "%"), "width": Measured(1e3 * rod.length, "mm")}


trials()["rod"] = Trial(Rod, stretch, {"error": "", "width": "mm"})
LENGTH = quantities(1.0, 10.0, "mm")
DRAWS["rods"] = tables(length=LENGTH)
DRAWS["refused rods"] = tables(length=LENGTH, fate="is refused")
TABLE = {
    "family": "elements",
    "title": "a rod",
    "why": "rods break",
    "trial": "rod",
    "parameters": {"length": "3 mm"},
    "bounds": {"error": "0.5 %", "width": "> 2 mm"},
}
