"""The input file of a run: which models, meshes, materials, shock, and where the results go."""

from pathlib import Path
from typing import Literal

from pydantic import Field

from fem.material_roles import Materials
from fem.parameters import Parameters, Shock


class RunInput(Parameters):
    """What ``python -m fem INPUT.json`` reads; SI floats."""

    mode: Literal["two_scale", "dns"]
    meshes: tuple[Path, ...] = Field(min_length=1)
    shock: Shock
    materials: Materials = Materials()
    output: Path
