"""The case: what a case file means, composed from the parameter models of the packages.

A case file is of one kind, by the table that only this kind has: [package], [drop], [joint], [drops], [oscillation].
"""

import os
import tomllib
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo

from fem.material_roles import Materials
from fem.parameters import Shock
from meshing.parameters import Board, Package, Warpage
from particles.parameters import Solder, Switch
from particles.scene_drops import Drops
from particles.scene_oscillation import Oscillation
from particles.scenes import Drop, Fluid, Joint, Liquid
from workflow import fields
from workflow.problems import CaseError, Problem, nearest
from workflow.stage_table import BOARD_DROP, DROP, DROPS, JOINT, OSCILLATION, Pipeline
from workflow.validation import translate

if TYPE_CHECKING:
    from particles.checks import Problem as ParticlesProblem

NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"


class Title(BaseModel):
    """Name and title of a case; the name is also that of its run folder."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[str, Field(pattern=NAME)]
    title: str = ""


class Case(BaseModel):
    """Everything that a run depends on, in SI floats.

    Attributes:
        kind: the table that makes a file a case of this kind.
        pipeline: its stages.
        case: its name.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: ClassVar[str]
    pipeline: ClassVar[Pipeline]

    case: Title

    @abstractmethod
    def problems(self) -> list[Problem]:
        """Find parameters that are each allowed, but impossible together."""

    @property
    def ranks(self) -> int:
        """MPI ranks that it asks for."""
        return 1


class BoardDropCase(Case):
    """A package on a board: its joints reflowed, then the board dropped."""

    kind = "package"
    pipeline = BOARD_DROP

    package: Package
    board: Board
    warpage: Warpage = Warpage()
    solder: Solder
    materials: Materials = Materials()
    shock: Shock

    def problems(self) -> list[Problem]:
        """Find parameters that make no possible package, joint or board together."""
        from meshing import checks as meshing_checks
        from meshing.pads import pad_table
        from particles import checks as particles_checks
        from workflow.reflow_pool import joint_geometries

        contradictions = meshing_checks.problems(self.package, self.board, self.warpage)
        if contradictions:
            known = {key: field for key, _, field in fields.leaves(self)}
            return [
                Problem(found.key, found.message, _shown(found.value, known.get(found.key)), found.allowed)
                for found in contradictions
            ]
        geometries = joint_geometries(pad_table(self.package, self.board, self.warpage))
        return _of_particles(particles_checks.problems(self.solder, geometries, self.package.pitch))

    @property
    def ranks(self) -> int:
        """MPI ranks of the shock."""
        return self.shock.ranks.macro + self.shock.ranks.meso


class SceneCase(Case):
    """Molten solder alone, without package and board; the table that names the kind holds its scene."""

    gravity: Switch = "auto"
    solder: Fluid = Field(default_factory=Fluid)

    @property
    def molten(self) -> Solder:
        """The solder as the solver takes it."""
        return self.solder.resolve(getattr(self, self.kind), self.gravity)


class DropCase(SceneCase):
    """A drop of solder on a wall or pad."""

    kind = "drop"
    pipeline = DROP

    drop: Drop

    def problems(self) -> list[Problem]:
        """Find parameters that make no possible drop together."""
        from particles.scene_checks import drop_problems

        return _of_particles(drop_problems(self.drop, self.molten))


class JointCase(SceneCase):
    """A joint of solder between two pads."""

    kind = "joint"
    pipeline = JOINT

    joint: Joint

    def problems(self) -> list[Problem]:
        """Find parameters that make no possible joint together."""
        from particles.scene_checks import joint_problems

        return _of_particles(joint_problems(self.joint, self.molten))


class DropsCase(SceneCase):
    """Two drops that become one, or stay apart."""

    kind = "drops"
    pipeline = DROPS

    drops: Drops

    def problems(self) -> list[Problem]:
        """Find parameters that make no possible pair together."""
        from particles.scene_checks import pair_problems

        return _of_particles(pair_problems(self.drops, self.molten))


class OscillationCase(Case):
    """A free drop that swings."""

    kind = "oscillation"
    pipeline = OSCILLATION

    oscillation: Oscillation
    solder: Liquid = Liquid()

    @property
    def molten(self) -> Solder:
        """The liquid as the solver takes it."""
        return self.oscillation.resolve(self.solder)

    def problems(self) -> list[Problem]:
        """Find a drop that does not swing."""
        from particles.scene_checks import oscillation_problems

        return _of_particles(oscillation_problems(self.oscillation, self.molten))


KINDS: dict[str, type[Case]] = {
    model.kind: model for model in (BoardDropCase, DropCase, JointCase, DropsCase, OscillationCase)
}


def kind_of(table: Mapping) -> type[Case]:
    """Return the model of a case file.

    Raises:
        CaseError: the file has the tables of no kind, or of several.
    """
    found = [kind for kind in KINDS if kind in table]
    if len(found) == 1:
        return KINDS[found[0]]
    choice = "exactly one of " + ", ".join(f"[{kind}]" for kind in KINDS)
    if found:
        message = "is of several kinds at once: it has " + " and ".join(f"[{kind}]" for kind in found)
        raise CaseError("case", [Problem("", message, None, choice)])
    hint = next((f"[{near}]" for name in table if (near := nearest(name, KINDS))), "")
    raise CaseError("case", [Problem("", "says not what kind of case it is", None, choice, hint)])


def read_case(path: Path, overrides: Sequence[str] = (), oversubscribe: bool = False) -> Case:
    """Read and check a case file.

    Args:
        path: TOML file.
        overrides: "dotted.key=value" settings, applied over the file; values are TOML, quotes may be left out.
        oversubscribe: whether more MPI ranks than cores are welcome.

    Returns:
        The case, every value checked.

    Raises:
        CaseError: with all problems found: syntax, names, units, ranges, and geometry that cannot be.
    """
    problems: list[Problem] = []
    table = _read_toml(path)
    overridden = _apply(table, overrides, problems)
    try:
        kind = kind_of(table)
    except CaseError as error:
        raise CaseError(str(path), error.problems + problems, overridden) from None
    values = fields.to_si_table(kind, table, "", problems)
    case = None
    try:
        case = kind.model_validate(values, strict=True)
    except ValidationError as error:
        problems += translate(kind, error, table, {problem.key for problem in problems})
    if case is not None and not problems:
        problems = case.problems() + too_many_ranks(case, oversubscribe)
    if case is None or problems:
        raise CaseError(str(path), problems, overridden)
    return case


def display_values(case: Case) -> dict[str, str]:
    """Return every parameter that has a value as dotted key -> text in the user's unit."""
    return {key: fields.display(value, field) for key, value, field in fields.leaves(case) if value is not None}


def too_many_ranks(case: Case, oversubscribe: bool) -> list[Problem]:
    """Find out whether a case asks for more MPI ranks than there are cores."""
    ranks, cores = case.ranks, available_cores()
    if oversubscribe or ranks <= cores:
        return []
    message = f"macro and meso ask for {ranks} MPI ranks, this machine offers {cores} cores"
    return [Problem("shock.ranks", message, ranks, f"<= {cores} in all, or more with --oversubscribe")]


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0))


def _of_particles(found: "Sequence[ParticlesProblem]") -> list[Problem]:
    return [Problem(problem.key, problem.message, problem.value or None, problem.allowed) for problem in found]


def _shown(value: object, field: FieldInfo | None) -> object:
    """Write an SI value as its field is shown to users."""
    return fields.display(value, field) if field is not None and fields.unit_of(field) else value


def _read_toml(path: Path) -> dict:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise CaseError(str(path), [Problem("", "no such case file")]) from error
    except (OSError, UnicodeDecodeError) as error:
        raise CaseError(str(path), [Problem("", f"cannot be read: {error}")]) from error
    except tomllib.TOMLDecodeError as error:
        raise CaseError(str(path), [Problem("", f"is not TOML: {error}")]) from error


def _apply(table: dict, overrides: Sequence[str], problems: list[Problem]) -> list[str]:
    """Write overrides into a table; return their keys."""
    keys = []
    for override in overrides:
        key, equals, text = override.partition("=")
        key = key.strip()
        keys.append(key)
        if not equals or not all(key.split(".")):
            problems.append(Problem(key, "is no setting", override, "--set dotted.key=value"))
        elif not _set(table, key.split("."), _override_value(text.strip())):
            problems.append(Problem(key, "lies below a value, not a table", text))
    return keys


def _override_value(text: str) -> object:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _set(table: dict, path: list[str], value: object) -> bool:
    for name in path[:-1]:
        table = table.setdefault(name, {})
        if not isinstance(table, dict):
            return False
    table[path[-1]] = value
    return True
