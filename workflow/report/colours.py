"""Colours of curves and colour scales, distinguishable with colour vision deficiency."""

from collections.abc import Sequence

BLUE, RED, GREEN, ORANGE, PURPLE, GREY = "#0b5fa5", "#d1495b", "#2a7d4f", "#e09f3e", "#7a5ea8", "#5f6c7b"
LIGHT, BLACK = "#9aa5b1", "#333333"
CYCLE = (BLUE, RED, GREEN, ORANGE, PURPLE, GREY)

# Equal steps of viridis (Smith, van der Walt; CC0), and of a scale from blue to orange: dichromats read both.
SCALES = {
    "sequential": [
        "#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725",
    ],
    "diverging": ["#08457f", "#3f7fb5", "#8fb9d8", "#d3e3ee", "#f7f7f7", "#f8dfc5", "#efb071", "#cd7628", "#8a4206"],
}  # fmt: skip


def colour_at(share: float, scale: Sequence[str] = tuple(SCALES["sequential"])) -> str:
    """Return the interpolated colour at a position of a scale, as ``#rrggbb``.

    Args:
        share: Position, 0 to 1.
        scale: Colours of the scale, from 0 to 1, evenly spaced.
    """
    position = min(max(share, 0.0), 1.0) * (len(scale) - 1)
    index = min(int(position), len(scale) - 2)
    low, high = _channels(scale[index]), _channels(scale[index + 1])
    mixed = [round(a + (position - index) * (b - a)) for a, b in zip(low, high, strict=True)]
    return "#" + "".join(f"{channel:02x}" for channel in mixed)


def ink_on(colour: str) -> str:
    """Return black or white as ``#rrggbb``, whichever is more legible on a colour.

    Args:
        colour: Colour of the background, ``#rrggbb``.
    """
    red, green, blue = _channels(colour)
    return "#000000" if 0.3 * red + 0.6 * green + 0.1 * blue > 127.0 else "#ffffff"


def _channels(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
