"""The height map of a printed part as a picture."""

from pathlib import Path

from reflowshock.arrays import Floats
from reflowshock.workflow.report.drawing import STYLE, pyplot


def draw_heights(path: Path, x: Floats, y: Floats, heights: Floats) -> None:
    """Write a PNG of heights `(i, j)` over x `(i,)` and y `(j,)`, all in m."""
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(figsize=(5.2, 4.4), layout="constrained")
        shown = axes.pcolormesh(1e6 * x, 1e6 * y, 1e6 * heights.T, cmap="viridis", shading="nearest")
        axes.set_aspect("equal")
        axes.set_xlabel("x [µm]")
        axes.set_ylabel("y [µm]")
        figure.colorbar(shown, label="height [µm]")
        figure.savefig(path, dpi=150, metadata={"Software": None})
        pyplot.close(figure)
