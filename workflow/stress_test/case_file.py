"""A hard case as text: the TOML file of a counterexample, ready to be kept among the fixed cases."""

from collections.abc import Iterator, Mapping
from typing import Any

from reflowshock.problem import as_toml


def hard_case_text(table: Mapping[str, Any]) -> str:
    """Write the table of a hard case as TOML."""
    return "\n".join(_lines(table, "")) + "\n"


def _lines(table: Mapping[str, Any], prefix: str) -> Iterator[str]:
    """Yield the values of a table, then its tables."""
    for name, value in table.items():
        if not isinstance(value, Mapping):
            yield f"{name} = {as_toml(value)}"
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield f"\n[{prefix}{name}]"
            yield from _lines(value, f"{prefix}{name}.")
