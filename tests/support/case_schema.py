"""Validation of case files against the JSON schema."""

import tomllib
from functools import cache
from pathlib import Path

import jsonschema

from reflowshock.workflow.pipeline.schema import case_schema


@cache
def _validator() -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(case_schema())


def validate(table: Path | dict) -> None:
    """Check a case file, or its contents as a dictionary, against the JSON schema.

    Raises:
        ValidationError: The schema rejects it.
    """
    _validator().validate(tomllib.loads(table.read_text()) if isinstance(table, Path) else table)
