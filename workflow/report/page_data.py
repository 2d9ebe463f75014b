"""Data of a page for its script: arrays, charts and scenes, as JSON that cannot be executed."""

import base64
import hashlib
import json
import zlib
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup
from numpy.typing import NDArray

from reflowshock.workflow.process.terminal import visible
from reflowshock.workflow.report.colours import SCALES

TYPES = {"f4", "u1", "u2", "u4", "i2"}  # array types with a typed array in the script


class Drawable(Protocol):
    """A chart or a scene."""

    def record(self, page: "PageData") -> dict:
        """Return the record that the script reads; its arrays are stored in the page."""


class PageData:
    """Arrays, charts and scenes of a page; equal arrays are stored once."""

    def __init__(self) -> None:
        """Create an empty page."""
        self._arrays: list[dict[str, str]] = []
        self._places: dict[bytes, int] = {}
        self._figures: list[list[dict]] = []
        self._scenes: list[dict] = []

    def array(self, values: NDArray, kind: str) -> int:
        """Store an array, little-endian and deflated, and return its number.

        Args:
            values: Array of any shape.
            kind: Type of ``TYPES``.

        Raises:
            ValueError: The type is not in ``TYPES``.
        """
        if kind not in TYPES:
            raise ValueError(f"arrays of type {kind} cannot be drawn; allowed: {', '.join(sorted(TYPES))}")
        raw = np.ascontiguousarray(values).astype(f"<{kind}").tobytes()
        digest = hashlib.sha256(kind.encode() + raw).digest()
        if digest not in self._places:
            self._places[digest] = len(self._arrays)
            self._arrays.append({"type": kind, "data": base64.b64encode(zlib.compress(raw, 6)).decode()})
        return self._places[digest]

    def charts(self, charts: Sequence[Drawable]) -> Markup:
        """Store charts and return the HTML element that shows them side by side."""
        self._figures.append([chart.record(self) for chart in charts])
        return Markup('<div class="charts" data-figure="{}"></div>').format(len(self._figures) - 1)

    def scene(self, scene: Drawable) -> Markup:
        """Store a scene and return the HTML element that shows it."""
        self._scenes.append(scene.record(self))
        return Markup('<div class="scene" data-scene="{}"></div>').format(len(self._scenes) - 1)

    def script_data(self) -> Markup:
        """Return all data as JSON without markup."""
        data = {"arrays": self._arrays, "figures": self._figures, "scenes": self._scenes, "scales": SCALES}
        return htmlsafe_json_dumps(_with_visible_controls(data), dumps=json.dumps, separators=(",", ":"))


def _with_visible_controls(value: Any) -> Any:
    """Return a record with visible control characters in its texts."""
    if isinstance(value, str):
        return visible(value)
    if isinstance(value, Mapping):
        return {key: _with_visible_controls(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_with_visible_controls(item) for item in value]
    return value
