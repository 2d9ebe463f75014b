"""Response spectra of the input, and tables of natural modes."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from reflowshock.workflow.report.charts import Axis, Chart, Series
from reflowshock.workflow.report.colours import CYCLE
from reflowshock.workflow.report.curves import GRAVITY

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reflowshock.fem.loads.pulse import Pulse

SAMPLES = 4000  # samples of an input
LOWEST = 0.1  # periods of the lowest frequency in the duration; boards may be slower than the pulse
LEAST = 20.0  # samples in a period of the highest frequency


def spectrum_curves(pulses: "Mapping[str, Pulse]", duration: float) -> list[Chart]:
    """Return a chart of the response spectra of inputs over the duration [s] of a run; empty without inputs.

    Args:
        pulses: Name -> input acceleration.
        duration: Duration of the run [s].

    Returns:
        Interactive charts for the report page.
    """
    from reflowshock.fem.output.response_spectrum import QUALITY, spectrum_frequencies

    if not pulses:
        return []
    frequencies = spectrum_frequencies(LOWEST / duration, SAMPLES / (LEAST * duration))
    lines = [
        Series(name, frequencies, spectrum(pulse, duration, frequencies), colour)
        for (name, pulse), colour in zip(pulses.items(), cycle(CYCLE), strict=False)
    ]
    level = Axis(f"peak acceleration, Q = {QUALITY:g} [G]")
    return [Chart(Axis("natural frequency [Hz]", log=True), level, lines, is_wide=True)]


def spectrum(pulse: "Pulse", duration: float, frequencies: "NDArray[np.float64]") -> "NDArray[np.float64]":
    """Return the shock response spectrum of a pulse: peak acceleration of an oscillator over its natural frequency.

    Args:
        pulse: Input acceleration over time.
        duration: Duration of the response [s].
        frequencies: Natural frequencies, shape (k,) [Hz].

    Returns:
        Peak accelerations, shape (k,) [G].
    """
    from reflowshock.fem.output.response_spectrum import response_spectrum

    step = duration / SAMPLES
    values = np.array([pulse.value(k * step) for k in range(SAMPLES + 1)])
    return response_spectrum(values, step, frequencies) / GRAVITY


def mode_table(modes: Sequence[Mapping]) -> dict:
    """Return the table of natural frequencies and effective mass fractions of the modes.

    Args:
        modes: Records with ``mode`` (number), ``frequency`` [Hz] and ``mass_fraction`` by axis "x", "y", "z".

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): mode, frequency [Hz], and effective mass along
        x, y and z [%].
    """
    rows = [
        [
            f"{mode['mode']}",
            f"{mode['frequency']:.2f}",
            *(f"{100 * mode['mass_fraction'][axis]:.1f} %" for axis in "xyz"),
        ]
        for mode in modes
    ]
    return {"head": ["mode", "frequency [Hz]", "effective mass, x", "y", "z"], "rows": rows}
