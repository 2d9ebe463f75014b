"""Case files against the JSON schema, which one test of the command line checks itself."""

import tomllib
from functools import cache
from pathlib import Path

import jsonschema

from reflowshock.workflow.pipeline.schema import case_schema


@cache
def _validator() -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(case_schema())


def validate(table: Path | dict) -> None:
    """Raise a ValidationError for a case file, or its table, that the schema refuses."""
    _validator().validate(tomllib.loads(table.read_text()) if isinstance(table, Path) else table)
