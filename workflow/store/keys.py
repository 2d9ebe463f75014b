"""Keys of products: a digest of a stage's parameters, of the stages that it follows, and of the program's version."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from reflowshock.workflow import __version__
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.stage import Stage

DIGITS = 12  # hexadecimal: two of a million products collide with a probability of 0.2 %


@dataclass(frozen=True, slots=True)
class Change:
    """Changed parameter of a product: key, old and new SI value (None if the key did not exist)."""

    key: str
    old: object
    new: object


def stage_inputs(case: Case, stage: Stage) -> dict:
    """Return the inputs of a stage: its parameters and the digests of its input files.

    Args:
        case: Case with all parameters.
        stage: Stage of the case's pipeline.

    Returns:
        Dotted key -> SI value, and for input files ``<key>.sha256`` -> digest.
    """
    contents = [(f"{key}.sha256", _digest(path)) for key, path in case.files.items()]
    return {key: value for key, value in [*_flat(case.model_dump(mode="json")), *contents] if stage.depends_on(key)}


def product_keys(case: Case) -> dict[str, str]:
    """Return the product key of each stage of a case; equal keys mean equal products.

    A key is a digest of the parameters of the stage and of all upstream stages, and of the program version. The names
    of case and scale enter only the key of the report.

    Args:
        case: Case with all parameters; its input files are read.

    Returns:
        Name of each stage -> key, hexadecimal digits.
    """
    keys: dict[str, str] = {}
    for stage in case.pipeline.stages:
        keys[stage.name] = product_key(case, stage, stage_inputs(case, stage), [keys[name] for name in stage.follows])
    return keys


def product_key(case: Case, stage: Stage, inputs: dict, follows: Sequence[str | None]) -> str:
    """Return the key of a product, a digest of all its inputs: parameters, input files and upstream products.

    Args:
        case: Case of the product; its name enters only the key of the report.
        stage: Stage that makes the product.
        inputs: Parameters of the stage, as returned by ``stage_inputs``.
        follows: Product keys of the stages that it follows, in order.

    Returns:
        First hexadecimal digits of a SHA-256.
    """
    content = {"version": __version__, "stage": f"{case.kind} {stage.name}", "inputs": inputs, "follows": follows}
    return digest_of(content)[:DIGITS]


def inputs_digest(case: Case) -> str:
    """Return one digest of all parameters and input files of a case that its stages depend on.

    Args:
        case: Case with all parameters; its input files are read.

    Returns:
        SHA-256 as hexadecimal text.
    """
    return digest_of({stage.name: stage_inputs(case, stage) for stage in case.pipeline.stages})


def digest_of(content: dict) -> str:
    """Return the SHA-256 of a table as hexadecimal text, independent of the order of its keys.

    Args:
        content: JSON data.
    """
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def compare(old: dict, new: dict) -> tuple[Change, ...]:
    """List the keys whose values differ between two sets of inputs, in the order of the new set, then of the old one.

    Args:
        old: Dotted key -> value, as from ``stage_inputs``.
        new: Dotted key -> value.

    Returns:
        Key, old and new value; None for a key that a set lacks.
    """
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
