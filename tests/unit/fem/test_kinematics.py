"""Messages about the effects that small kinematics neglect."""

from reflowshock.fem.problem.kinematics import finite_rotation


def test_finite_kinematics_leave_nothing_out():
    assert finite_rotation("dynamics", "finite", 0.0) == (True, "dynamics.kinematics = finite")


def test_strain_that_is_left_out_is_said():
    on, why = finite_rotation("shock.numerics", "small", 5.0e-5)
    assert not on
    assert "neglects strains of up to 50 µm/m" in why
    assert "not negligible" not in why


def test_strain_that_matters_points_to_the_cure():
    _, why = finite_rotation("shock.numerics", "small", 8.0e-3)
    assert why.endswith("not negligible, compare with a run of shock.numerics.kinematics = finite")
    assert "leaves out" not in finite_rotation("shock.numerics", "small")[1]
