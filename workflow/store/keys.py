"""Keys of products: a digest of a stage's parameters, of the stages that it follows, and of the program's version."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from reflowshock.workflow import __version__
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.stage import Stage

DIGITS = 12  # hexadecimal: two of a million products are alike with a probability of 0.2 %


@dataclass(frozen=True, slots=True)
class Change:
    """A parameter that has another value than when a product was made; SI values, None where it did not exist."""

    key: str
    old: object
    new: object


def stage_inputs(case: Case, stage: Stage) -> dict:
    """Return the parameters that a stage depends on, as dotted key -> SI value; of files, also what they hold."""
    contents = [(f"{key}.sha256", _digest(path)) for key, path in case.files.items()]
    return {key: value for key, value in [*_flat(case.model_dump(mode="json")), *contents] if stage.depends_on(key)}


def product_keys(case: Case) -> dict[str, str]:
    """Return for each stage the key of its product: stages with equal keys have equal products.

    It is a digest of the stage's own parameters, of those of all stages that it follows, and of the version. Names of
    case and scale enter the report's only.
    """
    found: dict[str, str] = {}
    for stage in case.pipeline.stages:
        found[stage.name] = product_key(case, stage, stage_inputs(case, stage), [found[name] for name in stage.follows])
    return found


def product_key(case: Case, stage: Stage, inputs: dict, follows: Sequence[str | None]) -> str:
    """Return the key of a product.

    Args:
        case: the case.
        stage: whose product it is.
        inputs: of the stage.
        follows: keys of the products of the stages that it follows.
    """
    content = {"version": __version__, "stage": f"{case.kind} {stage.name}", "inputs": inputs, "follows": follows}
    return digest_of(content)[:DIGITS]


def inputs_digest(case: Case) -> str:
    """Return the SHA-256 of all parameters of a case that its stages depend on."""
    return digest_of({stage.name: stage_inputs(case, stage) for stage in case.pipeline.stages})


def digest_of(content: dict) -> str:
    """Return the SHA-256 of a table, whatever the order of its keys."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def compare(old: dict, new: dict) -> tuple[Change, ...]:
    """List the keys of which two sets of inputs differ, in the order of the new one."""
    keys = [*new, *(key for key in old if key not in new)]
    return tuple(Change(key, old.get(key), new.get(key)) for key in keys if old.get(key) != new.get(key))


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "no such file"


def _flat(table: dict, prefix: str = "") -> Iterator[tuple[str, object]]:
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value
