"""Values of a study file as text for ``--set``, and ranges between two of them."""

import json
import tomllib

from reflowshock.workflow.case.units import QUANTITY

DIGITS = 6


def as_text(value: object) -> str:
    """Write a value of TOML as ``--set`` takes it: names, quantities and dates without quotes."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False) if _is_toml(value) else value
    return json.dumps(value, ensure_ascii=False, default=str)


def between(low: object, high: object, share: float) -> str | None:
    """Return the value at a share of a range, with six digits: a quantity, number or whole number; None if it is none.

    Args:
        low: its beginning, e.g. "0.8 mm".
        high: its end, in the same unit.
        share: 0 to 1.
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
