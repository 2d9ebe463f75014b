"""Materials: constants that cannot be are refused by name, and the three symmetries agree where they must."""

import numpy as np
import pytest
from pydantic import ValidationError

from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import FR4, SAC405
from reflowshock.materials.parameters import GeneralOrthotropic, JohnsonCook

RANDOM = np.random.default_rng(5)


def general(**changes: float) -> GeneralOrthotropic:
    """Return FR4 written with nine constants."""
    young, poisson, shear = FR4.engineering_constants
    constants = dict(zip([f"young_modulus_{axis}" for axis in "xyz"], young, strict=True))
    constants |= dict(zip([f"poisson_ratio_{pair}" for pair in ("xy", "yz", "xz")], poisson, strict=True))
    constants |= dict(zip([f"shear_modulus_{pair}" for pair in ("xy", "yz", "xz")], shear, strict=True))
    return GeneralOrthotropic(density=FR4.density, **(constants | changes))


def refused(make, *arguments, **changes) -> dict:
    """Return the only validation error of a function with arguments."""
    with pytest.raises(ValidationError) as caught:
        make(*arguments, **changes)
    assert caught.value.error_count() == 1
    return caught.value.errors()[0]


def test_nine_constants_of_a_laminate_are_the_laminate():
    assert elasticity_matrix(general()) == pytest.approx(elasticity_matrix(FR4), rel=1e-14)


def test_the_limit_of_a_laminate_is_where_its_energy_vanishes():
    bound = float(np.sqrt(0.5 * (1 - 0.11) * 27.924 / 12.204))
    values = FR4.model_dump() | {"poisson_ratio_out_of_plane": bound * (1 + 1e-9)}
    error = refused(type(FR4), **values)
    assert error["loc"] == ("poisson_ratio_out_of_plane",)
    assert error["ctx"]["allowed"] == f"> {-bound:.6g} and < {bound:.6g}"
    elasticity_matrix(type(FR4)(**(values | {"poisson_ratio_out_of_plane": bound * (1 - 1e-9)})))


def test_nine_constants_are_accepted_exactly_where_the_compliance_is_positive():
    accepted = 0
    for _ in range(300):
        young = 10.0 ** RANDOM.uniform(9, 11, 3)
        xy, yz, xz = (RANDOM.uniform(-1.1, 1.1) * np.sqrt(young[i] / young[j]) for i, j in ((0, 1), (1, 2), (0, 2)))
        normal = np.diag(1.0 / young)
        normal[0, 1] = normal[1, 0] = -xy / young[0]
        normal[1, 2] = normal[2, 1] = -yz / young[1]
        normal[0, 2] = normal[2, 0] = -xz / young[0]
        scale = np.sqrt(young)
        positive = np.linalg.eigvalsh(scale[:, None] * normal * scale)[0] > 0.0
        changes = {f"young_modulus_{axis}": value for axis, value in zip("xyz", young, strict=True)}
        changes |= {"poisson_ratio_xy": xy, "poisson_ratio_yz": yz, "poisson_ratio_xz": xz}
        try:
            general(**changes)
            accepted += 1
            assert positive
        except ValidationError:
            assert not positive
    assert 50 < accepted < 250


@pytest.mark.parametrize("density", [0.0, -7440.0])
def test_density_must_be_positive(density):
    error = refused(type(SAC405), density=density, young_modulus=1e9, poisson_ratio=0.3)
    assert error["loc"] == ("density",)


def test_plastic_material_must_be_solid():
    law = JohnsonCook(A=38e6, melting_temperature=490.15)
    values = SAC405.model_dump() | {"plasticity": law}
    assert refused(type(SAC405), **(values | {"temperature": 495.0}))["loc"] == ("temperature",)
    cold = JohnsonCook(A=38e6, room_temperature=250.0, melting_temperature=290.0)
    assert refused(type(SAC405), **(SAC405.model_dump(exclude={"temperature"}) | {"plasticity": cold}))
    error = refused(JohnsonCook, A=38e6, melting_temperature=290.0)
    assert error["ctx"]["allowed"] == "> 25 degC, the room_temperature"
    assert type(SAC405)(**(values | {"temperature": 489.0})).elastic.plasticity is None
