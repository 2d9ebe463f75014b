"""What the package on a joint does: float, or go along a path. Parameters in SI floats."""

from typing import Annotated, Literal

from pydantic import Field

from reflowshock.particles.parameters.solder import Parameters

PI = 3.14159265
Direction = Literal["lift", "shift", "turn"]


class FloatingPackage(Parameters):
    """A package that floats on the joint: free to lift, to shift (along x and y) or to turn (about x and y).

    Free to shift and to turn it would roll off: a pad is in balance anywhere on a sphere. The load presses it down: its
    weight over the number of its joints.
    """

    load: Annotated[float, "mN"] = Field(0.0, ge=0)
    free: tuple[Direction, ...] = Field(("lift", "shift"), min_length=1)


class PackagePath(Parameters):
    """A package that is moved slowly from where the joint reflows to another place; the joint comes to rest each step.

    What is not given stays as it was at the start.
    """

    standoff: Annotated[float | None, "mm"] = Field(None, gt=0)
    offset: Annotated[float | None, "mm"] = Field(None, ge=0)
    tilt: Annotated[float | None, "deg"] = Field(None, gt=-PI / 6.0, lt=PI / 6.0)
    steps: int = Field(10, ge=1, le=200)
