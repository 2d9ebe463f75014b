"""Convergence studies of drops, structures and packages: runs that can be run, and answers read from their products."""

import json

import numpy as np
import pytest

from reflowshock.particles.parameters.effects import decide_drop
from reflowshock.workflow.accuracy.recommend import Goal, recommend
from reflowshock.workflow.case.case import CASES
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.convergence.errors import Error, errors_of
from reflowshock.workflow.convergence.measured import Measurement, StageCost, fits_of
from reflowshock.workflow.convergence.packages import SAME_MESH, package_study
from reflowshock.workflow.convergence.series import ConvergenceStudy, Parameter, StudyRun, at_same_times
from reflowshock.workflow.convergence.solder import drop_study
from reflowshock.workflow.convergence.structures import structure_study
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.structure.findings import exact_velocities, wave_points
from tests.support.workflow_command import SMALL_CASE


def case_of(name, *settings):
    return read_case(CASES / name / "case.toml", settings)


@pytest.fixture(scope="module")
def bar():
    return case_of("two_scale_bar")


@pytest.fixture(scope="module")
def package():
    return case_of("bga_drop", "scale=quick")


def schemes_of(name, *settings):
    """Parameter of the study of a drop -> runs that can be read, and the reasons why others are refused."""
    found, refused = {}, []
    for run in drop_study(case_of(name, *settings)).runs:
        try:
            found.setdefault(run.parameter, {})[run.name] = case_of(
                name, *settings, *(f"{key}={value}" for key, value in run.settings.items())
            )
        except CaseError as error:
            refused.append(f"{run.name}: {error}")
    return found, refused


def test_schemes_of_a_drop_are_compared_at_the_same_spacings():
    found, refused = schemes_of("sessile_drop", "solder.effects.inertia=on", "solder.parameters=paper")
    names = ["particle spacing", "particle spacing, relaxation", "particle spacing, tetrahedra"]
    assert list(found) == names and not refused
    for name, inertia, scheme in zip(names, (True, False, True), ("ispg", "energy", "energy"), strict=True):
        cases = found[name].values()
        assert [case.drop.particles_per_edge for case in cases] == [5, 7, 9]
        assert {case.molten.numerics.scheme for case in cases} == {scheme}
        assert {case.molten.viscosity for case in cases} == {0.227}
        for case in cases:
            effects = decide_drop(case.molten, is_free=False)
            assert effects["inertia"]["on"] == effects["viscosity"]["on"] == inertia


def test_a_drop_without_inertia_is_compared_with_schemes_that_have_it():
    study = drop_study(case_of("sessile_drop"))
    assert [parameter.name.partition(", ")[2] for parameter in study.parameters] == [
        "", "quarter", "tetrahedra", "ISPG",
    ]  # fmt: skip
    (run,) = (run for run in study.runs if run.name == "7 per edge, ISPG")
    assert run.settings["solder.parameters"] == "paper"


@pytest.mark.parametrize(
    ("setting", "schemes", "count", "reason"),
    [
        ("drop.contact_angle=14 deg", {"ISPG"}, 3, "contact angles outside 15 deg to 148 deg"),
        ("drop.symmetry=quarter", {"tetrahedra", "gripc", "6"}, 6, "symmetry needs a drop that relaxes"),
    ],
)
def test_schemes_that_a_drop_refuses_are_left_out_with_the_reason(setting, schemes, count, reason):
    _found, refused = schemes_of("sessile_drop", setting)
    assert len(refused) == count
    assert all(any(scheme in one for scheme in schemes) for one in refused)
    assert any(reason in one for one in refused)


def test_histories_of_other_steps_are_compared_at_the_same_times():
    fine, coarse = (np.linspace(0.0, 1.0, count) for count in (101, 41))
    histories = [{"time": t, "a": np.sin(6.0 * t), "b": np.stack([t, t**2], axis=1)} for t in (fine, coarse)]
    first, second = (at_same_times(history, ("a", "b"), 1.0, 11) for history in histories)
    assert first.shape == (33,)
    assert first == pytest.approx(second, abs=1e-5)


def test_a_structure_of_which_nothing_could_be_compared_has_no_study():
    case = read_case(SMALL_CASE.with_name("structure.toml"))
    assert structure_study(case).judged == "displacement"
    with pytest.raises(CaseError, match="watch: has no watch point"):
        structure_study(case.model_copy(update={"watch": {}}))


@pytest.mark.parametrize("name", ["two_scale_bar", "cantilever"])
def test_runs_of_a_structure_can_be_run(name):
    study = structure_study(case_of(name))
    for run in study.runs:
        case = case_of(name, *(f"{key}={value}" for key, value in run.settings.items()))
        assert len(case.dynamics.solvers) == 1
    names = {run.name for run in study.runs}
    assert {run.against for run in study.runs if run.against} <= names
    assert len(study.parameters[0].values) >= 8


def test_elements_between_the_measured_ones_are_chosen_the_finer_way(bar):
    parameter = structure_study(bar).parameters[0]
    run = parameter.at(1.0 / 0.72)
    assert run.settings["structure.refine"] == "0.75"
    assert run.value == pytest.approx(1.0 / 0.75)
    assert parameter.at(parameter.values[0]).name == parameter.runs[0].name


def test_one_model_is_in_the_series_of_two_and_implicit_steps_in_that_of_one(bar):
    assert "element size, one model" in [one.name for one in structure_study(bar).parameters]
    assert "element size, implicit" in [
        parameter.name for parameter in structure_study(case_of("cantilever")).parameters
    ]
    yielding = structure_study(case_of("jedec_board", "dynamics.kinematics=finite", "dynamics.solver=explicit"))
    assert not any("implicit" in parameter.name for parameter in yielding.parameters)


def wave_run(folder, bar, shift):
    """Write the exact waves, moved by a time [s], as a run would leave them."""
    reference, own = bar.references["wave"], folder / "shock" / "explicit"
    own.mkdir(parents=True)
    places = {point: (0.0, 0.0, bar.watch[point].at[2]) for point in bar.watch}
    time = np.linspace(0.0, bar.dynamics.duration, 401)
    points = wave_points(reference)
    axial = exact_velocities(bar, reference, places, np.maximum(time - shift, 0.0)).reshape(len(points), -1)
    history = {f"velocity@{point}": np.outer(values, (0, 0, 1)) for point, values in zip(points, axial, strict=True)}
    np.savez(own / "history.npz", time=time, **history)
    watch = {point: {"node_at": place} for point, place in places.items()}
    (own / "result.json").write_text(json.dumps({"model": {"watch": watch}}))
    return folder


def test_exact_waves_have_no_error_and_late_ones_as_much_as_they_are_late(bar, tmp_path):
    study = structure_study(bar)
    runs = study.parameters[0].runs[:3]
    shifts = (8e-8, 4e-8, 0.0)
    answers = {
        run.name: study.measure(bar, wave_run(tmp_path / str(k), bar, shift))
        for k, (run, shift) in enumerate(zip(runs, shifts, strict=True))
    }
    errors = [found["wave_error"].value for found in errors_of(answers, runs, runs, 2.0).values()]
    assert errors[2] < 1e-3
    assert errors[0] == pytest.approx(2.0 * errors[1], rel=0.02)


def test_runs_of_a_package_can_be_run(package):
    study = package_study(package)
    names = {run.name for run in study.runs}
    assert {run.against for run in study.runs if run.against} <= names
    assert {run.against for run in study.runs if run.parameter == "coupling, same mesh"} == {SAME_MESH}
    for run in study.runs:
        settings = [f"{key}={value}" for key, value in run.settings.items()]
        assert len(case_of("bga_drop", "scale=quick", *settings).shock.numerics.modes) == 1


def test_elements_of_a_package_follow_their_size(package):
    (half,) = (run for run in package_study(package).runs if run.name == "all x 0.5")
    assert half.settings["board.numerics.element_size"] == "0.25 mm"
    assert half.settings["package.joint_numerics.core"] == "6"
    assert half.settings["package.joint_numerics.layers"] == "12"


def test_elements_of_imprinted_pads_follow_their_size():
    numerics = {"core": "4", "layers": "10", "pad_layer": "25 um", "copper_layers": "2"}
    settings = [f"package.joint_numerics.{key}={value}" for key, value in numerics.items()]
    imprinted = case_of("bga_drop", "scale=quick", *settings, "package.imprint={}")
    (half,) = (run for run in package_study(imprinted).runs if run.name == "all x 0.5")
    wanted = {"joint_numerics.core": "8", "joint_numerics.layers": "20", "joint_numerics.pad_layers": "4",
              "joint_numerics.copper_layers": "4", "imprint.rings": "10", "imprint.first_layer": "0.0075 mm",
              "imprint.growth": "1.325"}  # fmt: skip
    assert {key: half.settings[f"package.{key}"] for key in wanted} == wanted
    case = case_of(
        "bga_drop", "scale=quick", *settings, "package.imprint={}", *(f"{k}={v}" for k, v in half.settings.items())
    )
    assert case.package.imprint.growth == 1.325


def test_solder_that_yields_has_no_implicit_steps_nor_local_ones():
    runs = package_study(
        case_of("bga_drop", "scale=quick", "materials.solder=SAC405", "shock.numerics.plasticity=on")
    ).runs
    assert not any(run.settings.get("shock.numerics.dns_solver") == "implicit" for run in runs)
    assert not any(run.settings.get("shock.coupling.scheme") == "local_steps" for run in runs)


def test_meshes_of_what_yields_are_varied_by_two_models():
    """One model takes small steps everywhere; it is a choice, to the end of the shock also where it is cut short."""
    study = package_study(case_of("jedec_bga", "scale=quick"))
    runs = {run.name: run for run in study.runs}
    assert all(run.settings["shock.coupling.fine_joints"] == "all" for run in study.parameters[0].runs)
    assert runs["all x 0.5"].settings["shock.numerics.mass_scaled_step"] == "2 ns"
    assert {"1 fine", "3 fine", "1 fine: alone", "3 fine: alone"} <= runs.keys()
    assert "all fine" not in runs
    assert runs["one model: alone"].against == SAME_MESH
    assert runs["one model"].settings["shock.numerics.dns_duration"] == "0.4 ms"
    assert all(run.settings["shock.numerics.modes"] == '["two_scale"]' for run in study.parameters[0].runs)


def test_meshes_of_many_joints_that_yield_are_varied_with_some_of_them_fine():
    study = package_study(case_of("jedec_bga"))
    runs = {run.name: run for run in study.runs}
    assert all(run.settings["shock.coupling.critical_joints"] == "3" for run in study.parameters[0].runs)
    assert "3 fine" not in runs
    assert {"1 fine", "all fine"} <= runs.keys()


def test_a_package_is_judged_by_its_critical_joint(package, tmp_path):
    own = tmp_path / "shock" / "two_scale"
    own.mkdir(parents=True)
    time = np.linspace(0.0, package.shock.duration, 101)
    ramp = time / package.shock.duration
    stress = {"von_mises_board": np.outer(ramp, (1e6, 3e6)), "von_mises_package": np.outer(ramp, (2e6, 1e6))}
    moved = dict.fromkeys(("board_centre", "die_centre"), np.outer(ramp, (0, 0, 1e-3)))
    np.savez(own / "history.npz", time=time, joints=np.array(["A1", "A2"]), **stress, **moved)
    figures = {"critical_joint": "A2", "peel_stress": 3e6, "section_axial_force": 0.4, "section_bending_moment": 1e-5}
    figures |= {"layer_von_mises": 5e6}
    metrics = {name: {"value": value, "unit": ""} for name, value in figures.items()}
    (own / "result.json").write_text(json.dumps({"metrics": metrics}))
    found = package_study(package).measure(package, tmp_path)
    assert found["peel_stress"].value == pytest.approx(3e6)
    assert found["section_bending_moment"].scale == pytest.approx(0.4 * np.sqrt(0.4 / 3e6 / np.pi))
    assert "layer_plastic_work" not in found
    assert found["stress_history"].value.max() == pytest.approx(3e6)
    assert len(found["stress_history"].value) == 2 * (package.shock.numerics.history_samples + 1)


def test_a_package_without_a_shock_has_its_particles(tmp_path):
    text = (CASES / "bga_drop/case.toml").read_text()
    kept, skip = [], False
    for line in text.splitlines():
        if line.startswith("["):
            skip = line.startswith(("[shock", "[scales"))
        if not skip:
            kept.append(line)
    path = tmp_path / "case.toml"
    path.write_text("\n".join(kept))
    study = package_study(read_case(path, []))
    assert study.until == "reflow"
    assert [parameter.name for parameter in study.parameters] == ["particle spacing"]


def test_a_part_of_an_error_is_no_recommendation():
    """A parameter whose errors are from a run on the same mesh leaves out what the mesh errs."""

    def at(value: float) -> StudyRun:
        return StudyRun(f"step {value}", "step", {}, value, "mesh")

    study = ConvergenceStudy(
        "shock", ("shock",), {"wave": "wave"}, lambda case, folder: {}, (Parameter("step", (4.0, 2.0, 1.0), at),)
    )
    found = {
        run.name: Measurement(
            run.name, "step", run.value, {}, "", {"shock": StageCost(1.0, 1.0 + 1.0 / run.value, None)},
            {"wave": Error(1e-4 * run.value**2, "mesh")}, against=run.against,
        )
        for run in study.runs
    }  # fmt: skip
    fits = fits_of(study, found)
    assert fits["step"].errors["wave"].order == pytest.approx(2.0)
    assert recommend(study, found, fits, Goal(0.01)) is None
