"""The material of each role that a part of a package can have: a name of the library, or constants."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from reflowshock.fem.materials.library import COPPER, FR4, LIBRARY, SAC405, SILICON
from reflowshock.fem.materials.parameters import Material
from reflowshock.parameters import Parameters


@dataclass(frozen=True, slots=True)
class ByName:
    """Lets a field of parameters be given as one of some names, too."""

    choices: Mapping[str, BaseModel]

    def resolve(self, value: Any) -> Any:
        """Return what a name stands for; all else as it is.

        Raises:
            PydanticCustomError: A text that is no such name.
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
    """The material of each role that a part of the mesh can have.

    Each is a name of the library, such as "SAC305", or a table. Solder of the library yields, where the shock lets it.
    """

    board: NamedMaterial = FR4
    substrate: NamedMaterial = FR4
    die: NamedMaterial = SILICON
    copper: NamedMaterial = COPPER
    solder: NamedMaterial = SAC405

    @property
    def by_role(self) -> dict[str, Material]:
        """Return role -> its material."""
        return {role: getattr(self, role) for role in type(self).model_fields}


ELASTIC = Materials(solder=SAC405.elastic)  # nothing yields, as steps at several levels of linear elements want it
