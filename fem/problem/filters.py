"""Low-pass filter of accelerations (SAE J211-1 channel classes, Butterworth), labelled with its corner in reports."""

from typing import Annotated, Literal

from pydantic import Field

from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

TWO_PASSES = (2.0**0.5 - 1.0) ** 0.25  # -3 dB of two second-order passes over -3 dB of one
CFC_DESIGN = 2.0775  # SAE J211-1: -3 dB of one pass [Hz] over the channel frequency class


class LowPass(Parameters):
    """Zero-phase filter: it runs forwards and backwards, so that peaks are not delayed.

    ``cfc`` is a channel frequency class of SAE J211-1 (1000, 600, 180, 60), of second order each way. ``butterworth``
    has ``order`` each way and -3 dB of both passes together at ``corner``.
    """

    kind: Literal["cfc", "butterworth"] = "cfc"
    channel_class: float = Field(1000.0, gt=0)
    corner: Annotated[float | None, Quantity("Hz")] = Field(None, gt=0)
    order: int = Field(4, ge=1, le=8)

    @property
    def passes(self) -> tuple[int, float]:
        """Order of one pass, and its -3 dB frequency [Hz]."""
        if self.kind == "cfc" or self.corner is None:
            return 2, CFC_DESIGN * self.channel_class
        return self.order, self.corner / (2.0**0.5 - 1.0) ** (0.5 / self.order)

    @property
    def frequency(self) -> float:
        """Frequency [Hz] at which both passes together have -3 dB."""
        return CFC_DESIGN * TWO_PASSES * self.channel_class if self.corner is None else self.corner

    @property
    def label(self) -> str:
        """Name and corner of the filter, for reports."""
        name = f"CFC {self.channel_class:g}" if self.kind == "cfc" else f"Butterworth of order 2 x {self.order}"
        return f"{name}, -3 dB at {self.frequency:.4g} Hz"
