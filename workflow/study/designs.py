"""Designs of experiments: the settings of the points of a study, from grids, lists and Latin hypercubes."""

import json
import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from reflowshock.problem import Problem
from reflowshock.units import QUANTITY


@dataclass(frozen=True, slots=True)
class Hypercube:
    """Random Latin hypercube of n samples: each of n equal parts of the unit interval has one sample in each dimension.

    The hypercube grows by doubling from the odd factor of its size: each part is halved, and new samples fill the empty
    halves in random order. So 2 n samples contain the n samples; sizes with another odd factor share no samples.
    """

    samples: int
    seed: int

    def shares(self, dimensions: int) -> np.ndarray:
        """Return samples in [0, 1), shape (samples, dimensions)."""
        from scipy.stats import qmc

        size = self.samples // (self.samples & -self.samples)
        shares = qmc.LatinHypercube(dimensions, seed=np.random.default_rng((self.seed, size))).random(size)
        while size < self.samples:
            random = np.random.default_rng((self.seed, 2 * size))
            free = [np.setdiff1d(np.arange(2 * size), (2 * size * column).astype(int)) for column in shares.T]
            parts = np.stack([random.permutation(column) for column in free], axis=1)
            shares = np.concatenate([shares, (parts + random.random((size, dimensions))) / (2 * size)])
            size *= 2
        return shares


DIGITS = 6


def as_text(value: object) -> str:
    """Write a TOML value in the form of ``--set``: names, quantities and dates without quotes.

    Args:
        value: Value as ``tomllib`` returns it.
    """
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False) if _is_toml(value) else value
    return json.dumps(value, ensure_ascii=False, default=str)


def between(low: object, high: object, share: float) -> str | None:
    """Return the value at a relative position in a range, with six digits.

    Args:
        low: Lower end: a quantity such as "0.8 mm", a number or a whole number.
        high: Upper end, in the same unit.
        share: Relative position, 0 to 1.

    Returns:
        Text of the value; None if the ends do not form a range.
    """
    if isinstance(low, int) and isinstance(high, int) and not isinstance(low, bool) and not isinstance(high, bool):
        return str(min(low + int(share * (high - low + 1)), high))
    if isinstance(low, str) and isinstance(high, str):
        ends = QUANTITY.fullmatch(low), QUANTITY.fullmatch(high)
        if ends[0] is None or ends[1] is None or ends[0]["unit"] != ends[1]["unit"]:
            return None
        first, last = float(ends[0]["number"]), float(ends[1]["number"])
        return f"{(1.0 - share) * first + share * last:.{DIGITS}g} {ends[0]['unit']}"
    if isinstance(low, float | int) and isinstance(high, float | int):
        return f"{(1.0 - share) * low + share * high:.{DIGITS}g}"
    return None


def _is_toml(text: str) -> bool:
    try:
        tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return False
    return True


MOST_POINTS = 10_000
MOST_SAMPLED = 1_000_000  # values of a Latin hypercube
VALUES = 'a list of values; for several keys ("a, b") each item is one value or a list with one value per key'
RANGE = 'a range of two different values in the same unit, e.g. ["0.8 mm", "1 mm"]'


class TooManyPoints(ValueError):
    """Error of a study with too many points."""

    def __init__(self, count: int) -> None:
        super().__init__(f"would have {count} points")


@dataclass(frozen=True, slots=True)
class Factor:
    """Factor of a design.

    Attributes:
        keys: Dotted keys that vary together; the first one is the name of the factor.
        continuous: Whether its values are samples of a range instead of a few levels.
    """

    keys: tuple[str, ...]
    continuous: bool = False


@dataclass(frozen=True, slots=True)
class Design:
    """Design of a study.

    Attributes:
        factors: Varied factors.
        points: Settings of each point, dotted key -> text.
    """

    factors: tuple[Factor, ...] = ()
    points: tuple[Mapping[str, str], ...] = ({},)

    @property
    def keys(self) -> tuple[str, ...]:
        """Varied keys."""
        return tuple(key for factor in self.factors for key in factor.keys)

    @property
    def point_keys(self) -> tuple[str, ...]:
        """Keys of the points, varied or not; a key that a factor has twice occurs twice."""
        fixed = dict.fromkeys(key for point in self.points for key in point if key not in self.keys)
        return self.keys + tuple(fixed)

    def __mul__(self, other: "Design") -> "Design":
        """Return the design of all combinations of the points of two designs."""
        points = tuple({**first, **second} for first, second in product(self.points, other.points))
        return Design(self.factors + other.factors, points)

    @classmethod
    def of(cls, *axes: "Design") -> "Design":
        """Return all combinations of designs; without arguments, one point without settings.

        Raises:
            TooManyPoints: The number of combinations exceeds the limit.
        """
        count = math.prod(len(axis.points) for axis in axes)
        if count > MOST_POINTS:
            raise TooManyPoints(count)
        design = cls()
        for axis in axes:
            design = design * axis
        return design


def grid_axes(table: Mapping[str, object], problems: list[Problem]) -> Iterator[Design]:
    """Yield a design for each line ``"keys" = values`` of ``[grid]``.

    Args:
        table: Keys, joined by commas if they vary together -> list of values.
        problems: List to which errors are added.

    Yields:
        One factor (its keys) and the settings of each of its values.
    """
    for text, values in table.items():
        keys = _keys(text)
        if not isinstance(values, list) or not values:
            problems.append(Problem(f"grid.{text}", "must be a list with at least one value", values, VALUES))
            continue
        if len(values) > MOST_POINTS:
            problems.append(Problem(f"grid.{text}", f"has {len(values)} values", None, f"up to {MOST_POINTS}"))
            continue
        points = [_level(keys, value) for value in values]
        if len({tuple(point.items()) for point in points if point is not None}) < len(points) - points.count(None):
            problems.append(Problem(f"grid.{text}", "contains a value twice", values, VALUES))
        if None in points:
            problems.append(
                Problem(f"grid.{text}", f"must have one value for each of its {len(keys)} keys", values, VALUES)
            )
        yield Design((Factor(keys),), tuple(point for point in points if point is not None))


def list_axis(rows: Sequence[Mapping[str, object]], problems: list[Problem]) -> Design:
    """Return the design of ``[[list]]``; its factors are the keys that differ between rows.

    Args:
        rows: Tables ``[[list]]``, each dotted key -> value.
        problems: List to which errors are added.

    Returns:
        Factors and, for each row, its settings (dotted key -> text).
    """
    points = tuple({key: as_text(value) for key, value in row.items()} for row in rows)
    for index, point in enumerate(points):
        if missing := [key for key in points[0] if key not in point] + [key for key in point if key not in points[0]]:
            problems.append(
                Problem(
                    f"list.{missing[0]}", f"is not in all rows (see row {index + 1})", None, "the same keys in each"
                )
            )
    varied = [key for key in points[0] if len({point.get(key) for point in points}) > 1]
    return Design(tuple(Factor((key,)) for key in varied or points[0]), points)


def sample_axis(table: Mapping[str, object], cube: Hypercube, problems: list[Problem]) -> Design:
    """Return the design of ``[latin_hypercube]``; each line ``"keys" = [low, high]`` is one dimension.

    Args:
        table: Keys -> [low, high], as quantities or numbers.
        cube: Number of samples and seed of the Latin hypercube.
        problems: List to which errors are added.

    Returns:
        One continuous factor per line and, for each sample, its settings (dotted key -> text).
    """
    factors = [Factor(_keys(text), continuous=True) for text in table]
    ranges = []
    for factor, (text, ends) in zip(factors, table.items(), strict=True):
        key_ranges = _range(factor.keys, ends)
        if key_ranges is None:
            problems.append(Problem(f"latin_hypercube.ranges.{text}", "is not a range", ends, RANGE))
        else:
            ranges.append(key_ranges)
    if not table:
        problems.append(Problem("latin_hypercube.ranges", "is empty", None, RANGE))
    if len(factors) * cube.samples > MOST_SAMPLED:
        message = f"would have {len(factors) * cube.samples} values"
        problems.append(Problem("latin_hypercube", message, None, f"up to {MOST_SAMPLED}"))
        return Design()
    if not table or len(ranges) < len(factors):
        return Design()
    points = tuple(
        {
            key: str(between(*ends, share))
            for range_, share in zip(ranges, row, strict=True)
            for key, ends in range_.items()
        }
        for row in cube.shares(len(factors))
    )
    return Design(tuple(factors), points)


def _keys(text: str) -> tuple[str, ...]:
    return tuple(key.strip() for key in text.split(","))


def _level(keys: Sequence[str], value: object) -> dict[str, str] | None:
    """Return the settings of one value: a list with one value per key, or one value for all keys.

    A list of the wrong length gives None.
    """
    if len(keys) == 1 or not isinstance(value, list):
        return dict.fromkeys(keys, as_text(value))
    return {key: as_text(item) for key, item in zip(keys, value, strict=True)} if len(value) == len(keys) else None


def _range(keys: Sequence[str], ends: object) -> dict[str, tuple[object, object]] | None:
    """Return the lower and upper end of each key; None for an invalid range."""
    if not isinstance(ends, list) or len(ends) != 2:
        return None
    low, high = (end if isinstance(end, list) and len(keys) > 1 else [end] * len(keys) for end in ends)
    if len(low) != len(keys) or len(high) != len(keys):
        return None
    ranges = {key: (low[index], high[index]) for index, key in enumerate(keys)}
    texts = [[between(*range_, share) for range_ in ranges.values()] for share in (0.0, 1.0)]
    return None if None in texts[0] or texts[0] == texts[1] else ranges
