"""What a page's script draws: arrays, charts and scenes, as data that no browser takes for code."""

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

TYPES = {"f4", "u1", "u2", "u4", "i2"}  # of arrays: the script has a typed array for each


class Drawable(Protocol):
    """A chart or a scene."""

    def record(self, page: "PageData") -> dict:
        """Return what the script draws, its arrays kept by the page."""


class PageData:
    """All that a page's script draws; equal arrays are kept once."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self._arrays: list[dict[str, str]] = []
        self._places: dict[bytes, int] = {}
        self._figures: list[list[dict]] = []
        self._scenes: list[dict] = []

    def array(self, values: NDArray, kind: str) -> int:
        """Keep an array, little-endian and deflated; return its number.

        Args:
            values: of any shape.
            kind: one of ``TYPES``.
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
        """Return the place of some charts beside each other."""
        self._figures.append([chart.record(self) for chart in charts])
        return Markup('<div class="charts" data-figure="{}"></div>').format(len(self._figures) - 1)

    def scene(self, scene: Drawable) -> Markup:
        """Return the place of a scene."""
        self._scenes.append(scene.record(self))
        return Markup('<div class="scene" data-scene="{}"></div>').format(len(self._scenes) - 1)

    def script_data(self) -> Markup:
        """Return everything as JSON that holds no markup."""
        data = {"arrays": self._arrays, "figures": self._figures, "scenes": self._scenes, "scales": SCALES}
        return htmlsafe_json_dumps(_shown(data), dumps=json.dumps, separators=(",", ":"))


def _shown(value: Any) -> Any:
    """Return a record whose texts show their control characters."""
    if isinstance(value, str):
        return visible(value)
    if isinstance(value, Mapping):
        return {key: _shown(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_shown(one) for one in value]
    return value
