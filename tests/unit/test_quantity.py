from typing import Annotated

import pytest
from pydantic import Field

from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity
from reflowshock.units import UnitError


class Body(Parameters):
    height: Annotated[float, Quantity("mm")] = Field(2e-3, gt=0)
    gap: Annotated[float | None, Quantity("um")] = None
    times: Annotated[tuple[Annotated[float, Field(ge=0)], ...], Quantity("ms")] = ()
    place: Annotated[tuple[float, float], Quantity("mm")] = (0.0, 0.0)
    factor: float = 1.0


def test_a_quantity_is_converted_and_written_in_its_unit():
    length = Quantity("mm")
    assert length.to_si("480 um") == 4.8e-4
    assert length.text(4.8e-4) == "0.48 mm"
    assert (length.dimension, length.described) == ("length", "length, e.g. in mm")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("2 s", "is a time; expected a length, e.g. in mm"),
        ("2", 'needs a unit, such as "2 mm"'),
        (2.0, 'needs a unit, as a string such as "2 mm"'),
        ("2 mmm", '"mmm" is not a known unit; expected a length, e.g. in mm'),
    ],
)
def test_a_wrong_dimension_is_explained(text, message):
    with pytest.raises(UnitError) as caught:
        Quantity("mm").to_si(text)
    assert str(caught.value) == message


def test_models_hold_si_floats():
    assert Body.model_validate({"height": 0.1, "times": (0.5,)}, strict=True).model_dump()["height"] == 0.1
    with pytest.raises(ValueError, match="greater than 0"):
        Body(height=-1.0)


def test_the_json_schema_has_strings_with_an_example():
    properties = Body.model_json_schema()["properties"]
    for name, unit in (("height", "mm"), ("gap", "um")):
        assert properties[name]["type"] == "string"
        assert properties[name]["examples"] == [f"1 {unit}"]
        assert properties[name]["x-unit"] == unit
    assert properties["times"]["type"] == "array"
    assert properties["times"]["items"]["examples"] == ["1 ms"]
    assert (properties["place"]["minItems"], properties["place"]["maxItems"]) == (2, 2)
    assert properties["factor"]["type"] == "number"
