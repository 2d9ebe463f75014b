"""Materials of a package by role (board, substrate, die, copper, solder), and the role of a mesh part."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from reflowshock.materials.library import COPPER, FR4, LIBRARY, SAC405, SILICON
from reflowshock.materials.parameters import Material
from reflowshock.parameters import Parameters


@dataclass(frozen=True, slots=True)
class ByName:
    """Annotation of a parameter field that also accepts the name of a predefined value.

    Attributes:
        choices: Name -> predefined value.
    """

    choices: Mapping[str, BaseModel]

    def resolve(self, value: Any) -> Any:
        """Return the predefined value of a name, or any other value unchanged.

        Raises:
            PydanticCustomError: A string that is not the name of a predefined value.
        """
        if not isinstance(value, str):
            return value
        if value not in self.choices:
            raise PydanticCustomError("unknown_name", "must be a table or a known name", {"names": tuple(self.choices)})
        return self.choices[value]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.resolve, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"anyOf": [{"enum": list(self.choices)}, handler(schema)]}


NamedMaterial = Annotated[Material, ByName(LIBRARY)]


class Materials(Parameters):
    """Material of each role that a part of the mesh can have.

    Each is a name from the library, such as "SAC305", or a table of constants. Solder from the library is plastic
    unless the shock switches plasticity off. "FR4", or "FR4_board", is a board with its copper layers, "FR4_laminate"
    a laminate without copper. Board and substrate have "FR4" in drops and while cooling; there no copper layers are
    modelled either.
    """

    board: NamedMaterial = FR4
    substrate: NamedMaterial = FR4
    die: NamedMaterial = SILICON
    copper: NamedMaterial = COPPER
    solder: NamedMaterial = SAC405

    @property
    def by_role(self) -> dict[str, Material]:
        """Mapping of roles to materials."""
        return {role: getattr(self, role) for role in type(self).model_fields}


ELASTIC = Materials(solder=SAC405.elastic)  # step levels of linear elements require elastic materials


def role_of_part(part: str) -> str:
    """Return the material role of a mesh part, its name up to the first ``@`` or ``_``: "solder" for "solder@A1"."""
    return part.split("@")[0].split("_")[0]


def material_of_part(part: str, materials: Materials) -> Material:
    """Return the material of a mesh part by its role.

    Args:
        part: Name of the part, e.g. "solder@A1", which begins with its role.
        materials: Material of each role: board, substrate, die, copper and solder.

    Raises:
        ValueError: The role of the part has no material.
    """
    role = role_of_part(part)
    if role not in type(materials).model_fields:
        roles = ", ".join(type(materials).model_fields)
        raise ValueError(f"part {part!r} has the role {role!r}; materials exist for {roles}")
    material: Material = getattr(materials, role)
    return material


def materials_of_parts(
    parts: Sequence[str], materials: Materials | Mapping[str, Material]
) -> tuple[tuple[str, ...], tuple[Material, ...]]:
    """Return the role and the material of each mesh part.

    Args:
        parts: Names of the parts.
        materials: Materials by role, or a mapping of parts to materials, in which the name of a part is its role.

    Returns:
        Roles and materials, both in the order of ``parts``.

    Raises:
        ValueError: A part has no material.
    """
    if isinstance(materials, Materials):
        assigned = tuple(material_of_part(part, materials) for part in parts)
        return tuple(role_of_part(part) for part in parts), assigned
    missing = [part for part in parts if part not in materials]
    if missing:
        raise ValueError(f"part {missing[0]!r} has no material; materials exist for {', '.join(materials)}")
    return tuple(parts), tuple(materials[part] for part in parts)
