"""Convergence studies of drops, structures and packages: validity of their runs, and quantities read from products."""

import json

import numpy as np
import pytest

from reflowshock.particles.parameters.effects import decide_drop
from reflowshock.workflow.accuracy.recommend import Goal, recommend
from reflowshock.workflow.case.case import CASES
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.convergence.accuracy_file import Measurement, StageCost, fit_measurements
from reflowshock.workflow.convergence.convergence_study import ConvergenceStudy, Parameter, StudyRun, resample
from reflowshock.workflow.convergence.errors import Error, compute_errors
from reflowshock.workflow.convergence.packages import SAME_MESH, board_drop_study, package_study
from reflowshock.workflow.convergence.solder import drop_study
from reflowshock.workflow.convergence.structures import structure_study
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.structure.findings import exact_velocities, wave_points
from tests.support.workflow_command import SMALL_CASE


def case_of(name, *settings):
    """Return a case of the checkout with settings."""
    return read_case(CASES / name / "case.toml", settings)


@pytest.fixture(scope="module")
def bar():
    """Return the case ``two_scale_bar``."""
    return case_of("two_scale_bar")


@pytest.fixture(scope="module")
def package():
    """Return the case ``bga_drop`` at its quick scale."""
    return case_of("bga_drop", "scale=quick")


def schemes_of(name, *settings):
    """Return parameter -> valid runs of the study of a drop, and the messages of rejected runs."""
    valid, rejected = {}, []
    for run in drop_study(case_of(name, *settings)).runs:
        try:
            valid.setdefault(run.parameter, {})[run.name] = case_of(
                name, *settings, *(f"{key}={value}" for key, value in run.settings.items())
            )
        except CaseError as error:
            rejected.append(f"{run.name}: {error}")
    return valid, rejected


def test_schemes_of_a_drop_are_compared_at_the_same_spacings():
    valid, rejected = schemes_of("sessile_drop", "solder.effects.inertia=on", "solder.parameters=paper")
    names = ["particle spacing", "particle spacing, relaxation", "particle spacing, tetrahedra"]
    assert list(valid) == names and not rejected
    for name, inertia, scheme in zip(names, (True, False, True), ("ispg", "energy", "energy"), strict=True):
        cases = valid[name].values()
        assert [case.drop.particles_per_edge for case in cases] == [5, 7, 9]
        assert {case.molten.numerics.scheme for case in cases} == {scheme}
        assert {case.molten.viscosity for case in cases} == {0.227}
        for case in cases:
            effects = decide_drop(case.molten, is_free=False)
            assert effects["inertia"]["on"] == effects["viscosity"]["on"] == inertia


def test_drop_without_inertia_is_compared_with_schemes_with_inertia():
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
def test_unsupported_schemes_of_a_drop_are_left_out_with_the_reason(setting, schemes, count, reason):
    _valid, rejected = schemes_of("sessile_drop", setting)
    assert len(rejected) == count
    assert all(any(scheme in message for scheme in schemes) for message in rejected)
    assert any(reason in message for message in rejected)


def test_histories_with_different_steps_are_resampled():
    fine, coarse = (np.linspace(0.0, 1.0, count) for count in (101, 41))
    histories = [{"time": t, "a": np.sin(6.0 * t), "b": np.stack([t, t**2], axis=1)} for t in (fine, coarse)]
    first, second = (resample(history, ("a", "b"), 1.0, 11) for history in histories)
    assert first.shape == (33,)
    assert first == pytest.approx(second, abs=1e-5)


def test_structure_without_reference_and_watch_point_has_no_study():
    case = read_case(SMALL_CASE.with_name("structure.toml"))
    assert structure_study(case).judged == "displacement"
    with pytest.raises(CaseError, match="requires an exact reference or a watch point"):
        structure_study(case.model_copy(update={"watch": {}}))


@pytest.mark.parametrize("name", ["two_scale_bar", "cantilever"])
def test_runs_of_a_structure_are_valid_cases(name):
    study = structure_study(case_of(name))
    for run in study.runs:
        case = case_of(name, *(f"{key}={value}" for key, value in run.settings.items()))
        assert len(case.dynamics.solvers) == 1
    names = {run.name for run in study.runs}
    assert {run.against for run in study.runs if run.against} <= names
    assert len(study.parameters[0].values) >= 8


def test_element_size_between_measured_ones_is_rounded_to_the_finer_side(bar):
    parameter = structure_study(bar).parameters[0]
    run = parameter.run_at(1.0 / 0.72)
    assert run.settings["structure.refine"] == "0.75"
    assert run.value == pytest.approx(1.0 / 0.75)
    assert parameter.run_at(parameter.values[0]).name == parameter.runs[0].name


def test_parameters_include_one_model_or_implicit_steps(bar):
    assert "element size, one model" in [parameter.name for parameter in structure_study(bar).parameters]
    assert "element size, implicit" in [
        parameter.name for parameter in structure_study(case_of("cantilever")).parameters
    ]
    yielding = structure_study(case_of("jedec_board", "dynamics.kinematics=finite", "dynamics.solver=explicit"))
    assert not any("implicit" in parameter.name for parameter in yielding.parameters)


def wave_run(folder, bar, shift):
    """Write the exact waves, delayed by ``shift`` [s], as products of a run."""
    reference, products = bar.references["wave"], folder / "shock" / "explicit"
    products.mkdir(parents=True)
    positions = {point: (0.0, 0.0, bar.watch[point].at[2]) for point in bar.watch}
    time = np.linspace(0.0, bar.dynamics.duration, 401)
    points = wave_points(reference)
    axial = exact_velocities(bar, reference, positions, np.maximum(time - shift, 0.0)).reshape(len(points), -1)
    history = {f"velocity@{point}": np.outer(values, (0, 0, 1)) for point, values in zip(points, axial, strict=True)}
    np.savez(products / "history.npz", time=time, **history)
    watch = {point: {"node_at": position} for point, position in positions.items()}
    (products / "result.json").write_text(json.dumps({"model": {"watch": watch}}))
    return folder


def test_delayed_waves_have_an_error_proportional_to_the_delay(bar, tmp_path):
    study = structure_study(bar)
    runs = study.parameters[0].runs[:3]
    shifts = (8e-8, 4e-8, 0.0)
    results = {
        run.name: study.measure(bar, wave_run(tmp_path / str(k), bar, shift))
        for k, (run, shift) in enumerate(zip(runs, shifts, strict=True))
    }
    errors = [run_errors["wave_error"].value for run_errors in compute_errors(results, runs, runs, 2.0).values()]
    assert errors[2] < 1e-3
    assert errors[0] == pytest.approx(2.0 * errors[1], rel=0.02)


def test_runs_of_a_board_drop_are_valid_cases(package):
    study = board_drop_study(package)
    names = {run.name for run in study.runs}
    assert {run.against for run in study.runs if run.against} <= names
    assert {run.against for run in study.runs if run.parameter == "coupling, same mesh"} == {SAME_MESH}
    for run in study.runs:
        settings = [f"{key}={value}" for key, value in run.settings.items()]
        assert len(case_of("bga_drop", "scale=quick", *settings).shock.numerics.modes) == 1


def test_element_size_scales_board_and_joints(package):
    (half,) = (run for run in board_drop_study(package).runs if run.name == "all x 0.5")
    assert half.settings["board.numerics.element_size"] == "0.25 mm"
    assert half.settings["package.joint_numerics.core"] == "6"
    assert half.settings["package.joint_numerics.layers"] == "12"


def test_element_size_scales_imprinted_pads():
    numerics = {"core": "4", "layers": "10", "pad_layer": "25 um", "copper_layers": "2"}
    settings = [f"package.joint_numerics.{key}={value}" for key, value in numerics.items()]
    imprinted = case_of("bga_drop", "scale=quick", *settings, "package.imprint={}")
    (half,) = (run for run in board_drop_study(imprinted).runs if run.name == "all x 0.5")
    expected = {"joint_numerics.core": "8", "joint_numerics.layers": "20", "joint_numerics.pad_layers": "4",
              "joint_numerics.copper_layers": "4", "imprint.rings": "10", "imprint.first_layer": "0.0075 mm",
              "imprint.growth": "1.325"}  # fmt: skip
    assert {key: half.settings[f"package.{key}"] for key in expected} == expected
    case = case_of(
        "bga_drop", "scale=quick", *settings, "package.imprint={}", *(f"{k}={v}" for k, v in half.settings.items())
    )
    assert case.package.imprint.growth == 1.325


def test_plastic_solder_has_neither_implicit_nor_local_steps():
    runs = board_drop_study(
        case_of("bga_drop", "scale=quick", "materials.solder=SAC405", "shock.numerics.plasticity=on")
    ).runs
    assert not any(run.settings.get("shock.numerics.dns_solver") == "implicit" for run in runs)
    assert not any(run.settings.get("shock.coupling.scheme") == "local_steps" for run in runs)


def test_meshes_with_plastic_solder_are_varied_by_two_models():
    """One model would take small steps everywhere; it is a choice that covers the full duration."""
    study = board_drop_study(case_of("jedec_bga", "scale=quick"))
    runs = {run.name: run for run in study.runs}
    assert all(run.settings["shock.coupling.fine_joints"] == "all" for run in study.parameters[0].runs)
    assert runs["all x 0.5"].settings["shock.numerics.mass_scaled_step"] == "2 ns"
    assert {"1 fine", "3 fine", "1 fine: alone", "3 fine: alone"} <= runs.keys()
    assert "all fine" not in runs
    assert runs["one model: alone"].against == SAME_MESH
    assert runs["one model"].settings["shock.numerics.dns_duration"] == "0.4 ms"
    assert all(run.settings["shock.numerics.modes"] == '["two_scale"]' for run in study.parameters[0].runs)


def test_meshes_with_many_plastic_joints_are_varied_with_a_few_fine_joints():
    study = board_drop_study(case_of("jedec_bga"))
    runs = {run.name: run for run in study.runs}
    assert all(run.settings["shock.coupling.critical_joints"] == "3" for run in study.parameters[0].runs)
    assert "3 fine" not in runs
    assert {"1 fine", "all fine"} <= runs.keys()


def test_board_drop_is_judged_by_its_critical_joint(package, tmp_path):
    products = tmp_path / "shock" / "two_scale"
    products.mkdir(parents=True)
    time = np.linspace(0.0, package.shock.duration, 101)
    ramp = time / package.shock.duration
    stress = {"von_mises_board": np.outer(ramp, (1e6, 3e6)), "von_mises_package": np.outer(ramp, (2e6, 1e6))}
    deflections = dict.fromkeys(("board_centre", "die_centre"), np.outer(ramp, (0, 0, 1e-3)))
    np.savez(products / "history.npz", time=time, joints=np.array(["A1", "A2"]), **stress, **deflections)
    figures = {"critical_joint": "A2", "peel_stress": 3e6, "section_axial_force": 0.4, "section_bending_moment": 1e-5}
    figures |= {"layer_von_mises": 5e6}
    metrics = {name: {"value": value, "unit": ""} for name, value in figures.items()}
    (products / "result.json").write_text(json.dumps({"metrics": metrics}))
    quantities = board_drop_study(package).measure(package, tmp_path)
    assert quantities["peel_stress"].value == pytest.approx(3e6)
    assert quantities["section_bending_moment"].scale == pytest.approx(0.4 * np.sqrt(0.4 / 3e6 / np.pi))
    assert "layer_plastic_work" not in quantities
    assert quantities["stress_history"].value.max() == pytest.approx(3e6)
    assert len(quantities["stress_history"].value) == 2 * (package.shock.numerics.history_samples + 1)


def test_package_without_a_shock_varies_its_particle_spacing(tmp_path):
    text = (CASES / "bga_drop/case.toml").read_text()
    lines, skip = [], False
    for line in text.splitlines():
        if line.startswith("["):
            skip = line.startswith(("[shock", "[scales"))
        if not skip:
            lines.append(line)
    path = tmp_path / "case.toml"
    path.write_text("\n".join(lines))
    study = package_study(read_case(path, []))
    assert study.until == "reflow"
    assert [parameter.name for parameter in study.parameters] == ["particle spacing"]


def test_partial_error_is_not_recommended():
    """Errors against a run on the same mesh exclude the error of the mesh."""

    def run_at(value: float) -> StudyRun:
        return StudyRun(f"step {value}", "step", {}, value, "mesh")

    study = ConvergenceStudy(
        "shock", ("shock",), {"wave": "wave"}, lambda case, folder: {}, (Parameter("step", (4.0, 2.0, 1.0), run_at),)
    )
    measurements = {
        run.name: Measurement(
            run.name, "step", run.value, {}, "", {"shock": StageCost(1.0, 1.0 + 1.0 / run.value, None)},
            {"wave": Error(1e-4 * run.value**2, "mesh")}, against=run.against,
        )
        for run in study.runs
    }  # fmt: skip
    fits = fit_measurements(study, measurements)
    assert fits["step"].errors["wave"].order == pytest.approx(2.0)
    assert recommend(study, measurements, fits, Goal(0.01)) is None
