"""Health checks in words: value and limit with the unit of what is checked."""

import re

UNITS = {
    r".*peel_stress": "Pa", r".*plastic_work_density": "J/m^3", r"(\w+_)?frequency_\d+_(low|high)": "Hz",
    r"standoff_spread_.*": "m",
}  # fmt: skip


def against_limit(name: str, check: dict) -> tuple[str, str]:
    """Return value and limit of a check."""
    from reflowshock.workflow.report.tables import quantity

    unit = next((unit for pattern, unit in UNITS.items() if re.fullmatch(pattern, name)), "")
    value, limit = (quantity({"value": check[key], "unit": unit}) for key in ("value", "limit"))
    return value, limit
