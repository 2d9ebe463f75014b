"""Scales of a case file: values of a scale replace values of the file, settings replace both."""

import pytest

from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.template import templates, write_new_case
from reflowshock.workflow.store.keys import stage_inputs
from tests.support.workflow_command import SMALL_CASE

SCALES = """
[scales.quick]
"board.numerics.coarse_size" = "3 mm"
package.joint_numerics = { layers = 5 }
"shock.duration" = "0.02 ms"

[scales.fine]
"board.numerics.coarse_size" = "1 mm"
"""


@pytest.fixture
def case_file(tmp_path):
    """The shortened case with two scales."""

    def write(text: str = SCALES, top: str = ""):
        path = tmp_path / "case.toml"
        path.write_text(top + SMALL_CASE.read_text() + text)
        return path

    return write


def lines_of(path, *settings) -> str:
    """Return the error message of a case with settings, which must be rejected."""
    with pytest.raises(CaseError) as caught:
        read_case(path, settings)
    return "\n".join(caught.value.lines())


def test_without_a_scale_the_file_counts(case_file):
    case, plain = read_case(case_file()), read_case(SMALL_CASE)
    assert case == plain
    assert (case.scale, case.run_name) == ("full", "small")


@pytest.mark.parametrize("top", ["", 'scale = "quick"\n'])
def test_a_scale_replaces_values_and_keeps_all_others(case_file, top):
    path = case_file(top=top)
    case = read_case(path, [] if top else ["scale=quick"])
    assert case.board.numerics.coarse_size == pytest.approx(3e-3)
    assert (case.package.joint_numerics.layers, case.shock.duration) == (5, pytest.approx(2e-5))
    assert (case.scale, case.run_name) == ("quick", "small-quick")
    same = case.model_copy(
        update={name: getattr(read_case(path, ["scale=full"]), name) for name in ("scale", "shock", "package", "board")}
    )
    assert same == read_case(SMALL_CASE)


def test_settings_count_more_than_the_scale(case_file):
    case = read_case(case_file(), ["shock.duration=0.01 ms", 'scale="quick"'])
    assert case.shock.duration == pytest.approx(1e-5)
    assert case.package.joint_numerics.layers == 5


@pytest.mark.parametrize(
    ("text", "setting", "words"),
    [
        (SCALES, "scale=quik", ['--set: scale = "quik"', "one of full, quick, fine", "did you mean quick?"]),
        ("", "scale=quick", ['scale = "quick"', "unknown scale", "one of full"]),
        ("[scales.full]\nx = 1\n", "scale=full", ["scales.full", "is reserved for the file itself"]),
        ("[scales]\nquick = 3\n", "scale=full", ["scales.quick = 3", "must be a table", "coarse_size"]),
        ('[scales.quick]\n"board.thicknes" = "1 mm"\n', "scale=quick",
         ["[scales.quick]: board.thicknes", "unknown key", "board.thickness?"]),
        ('[scales.quick]\n"board.thickness" = "1 kg"\n', "scale=quick",
         ["[scales.quick]: board.thickness", "is a mass"]),
        ('[scales.quick]\n"board.thickness.x" = 1\n', "scale=quick",
         ["[scales.quick]: board.thickness.x", "cannot be set: the key above it has a value"]),
    ],
)  # fmt: skip
def test_wrong_scales_are_named(case_file, text, setting, words):
    messages = lines_of(case_file(text), setting)
    assert [word for word in words if word not in messages] == []


def test_scales_of_a_template_come_along(case_file, tmp_path, monkeypatch):
    monkeypatch.setattr("reflowshock.workflow.pipeline.template.templates", lambda: {"small": case_file()})
    path = write_new_case("mine", "small", tmp_path)
    assert read_case(path).scale == "full"
    assert read_case(path, ["scale=quick"]).shock.duration == pytest.approx(2e-5)


@pytest.mark.parametrize("name", templates())
def test_every_scale_of_the_cases_is_a_case(name):
    import tomllib

    path = templates()[name]
    for scale in tomllib.loads(path.read_text()).get("scales", {}):
        assert read_case(path, [f"scale={scale}"], oversubscribe=True).scale == scale


def test_a_package_without_a_shock_ends_with_its_joints(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(SMALL_CASE.read_text().split("[shock]")[0])
    case = read_case(path)
    assert case.pipeline.names == ("geometry", "reflow", "surface", "solder_mesh", "report")
    used = {key for stage in case.pipeline.stages for key in stage_inputs(case, stage)}
    assert {"solder.volume", "warpage.corner", "materials.solder.young_modulus"} <= used
    path.write_text(path.read_text() + '[shok]\nduration = "1 ms"\n')
    messages = lines_of(path)
    assert [word for word in ("shok", "unknown key", "did you mean shock?") if word not in messages] == []


def test_with_temperatures_the_reflow_needs_the_mesh(case_file):
    case = read_case(case_file("\n[thermal]\n"), ["warpage.corner=0 mm"])
    reflow, shock = case.pipeline["reflow"], case.pipeline["shock"]
    assert (reflow.follows, reflow.pads) == (("geometry",), False)
    assert "reflow/structure.npz" in reflow.products
    inputs = {stage.name: stage_inputs(case, stage) for stage in (reflow, shock)}
    assert {"thermal.peak", "materials.die.young_modulus"} <= inputs["reflow"].keys()
    assert "thermal.effects.residual_stress" in inputs["shock"]
    assert (
        not {"thermal.final", "thermal.effects.residual_stress", "materials.solder.density"} & inputs["reflow"].keys()
    )
