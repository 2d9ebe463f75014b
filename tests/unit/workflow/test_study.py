"""Studies: designs, tables of results, main effects; nothing is computed."""

import csv
from pathlib import Path

import numpy as np
import pytest

from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.jobs.batch import Machine, list_missing
from reflowshock.workflow.kinds import stage_seconds
from reflowshock.workflow.pipeline.points import PointsError
from reflowshock.workflow.store.store import Store
from reflowshock.workflow.study import tables
from reflowshock.workflow.study.command import has_metrics, read_points_of, results, run_study
from reflowshock.workflow.study.designs import Factor, Hypercube, as_text, between
from reflowshock.workflow.study.main_effects import effect_of, rank_parameters
from reflowshock.workflow.study.process_map import outcomes, process_map
from reflowshock.workflow.study.progress import forecast_stages, seconds_left
from reflowshock.workflow.study.results import HEALTHY, IMPOSSIBLE, UNHEALTHY, Row, columns, write_csv, write_parquet
from reflowshock.workflow.study.study_file import read_study
from tests.support.workflow_command import SMALL_CASE

HEAD = f'[study]\nname = "mine"\ncase = "{SMALL_CASE}"\nrank_by = "stress"\n'
GRID = '[grid]\n"package.pitch" = ["0.9 mm", "1 mm"]\n"solder.volume" = ["0.07 mm^3", "0.0724 mm^3"]\n'


@pytest.fixture
def write(tmp_path):
    """Return a function that writes a study file and returns its path."""

    def study(text: str, head: str = HEAD) -> Path:
        path = tmp_path / "study.toml"
        path.write_text(head + text)
        return path

    return study


def test_grid_is_every_combination_and_keys_may_vary_together(write):
    study = read_study(write('[grid]\n"a.b" = [1, 2]\n"c, d.e" = ["x", ["y", true]]\n[settings]\nf.g = "1 mm"\n'))
    assert study.points == [
        {"f.g": "1 mm", "a.b": a, "c": c, "d.e": e} for a in ("1", "2") for c, e in (("x", "x"), ("y", "true"))
    ]
    assert [factor.keys for factor in study.design.factors] == [("a.b",), ("c", "d.e")]


def test_rows_of_a_list_are_combined_with_the_grid(write):
    study = read_study(write('[[list]]\na = 1\nb = "k"\n[[list]]\na = 2\nb = "k"\n[grid]\nc = [0.5]\n'))
    assert study.points == [{"c": "0.5", "a": "1", "b": "k"}, {"c": "0.5", "a": "2", "b": "k"}]
    assert [factor.keys for factor in study.design.factors] == [("c",), ("a",)]


@pytest.mark.parametrize("samples", [1, 6, 7, 24])
def test_each_part_of_a_range_has_one_sample(samples):
    shares = Hypercube(samples, seed=3).shares(4)
    for column in shares.T:
        assert sorted((samples * column).astype(int)) == list(range(samples))


def test_doubled_hypercube_contains_the_earlier_samples():
    small, large = Hypercube(6, 1).shares(3), Hypercube(24, 1).shares(3)
    assert np.array_equal(small, large[:6])
    assert not np.array_equal(Hypercube(6, 2).shares(3), small)


def test_samples_are_quantities_in_the_unit_of_their_range(write):
    text = '[latin_hypercube]\nsamples = 4\nseed = 1\n[latin_hypercube.ranges]\n"a" = ["2 mm", "6 mm"]\n"n" = [1, 4]\n'
    points = read_study(write(text)).points
    values = sorted(float(point["a"].removesuffix(" mm")) for point in points)
    assert all(2.0 + k <= value <= 3.0 + k for k, value in enumerate(values))
    assert sorted(point["n"] for point in points) == ["1", "2", "3", "4"]


@pytest.mark.parametrize(
    ("value", "text"),
    [("1 mm", "1 mm"), ("B", "B"), ("2", '"2"'), (2, "2"), (True, "true"), (["a", "b"], '["a", "b"]'), (0.5, "0.5")],
)
def test_values_are_written_in_the_form_of_set(value, text):
    assert as_text(value) == text


def test_ends_of_a_range_must_have_one_unit():
    assert between("1 mm", "2 mm", 0.25) == "1.25 mm"
    assert between(1.0, 2, 0.5) == "1.5"
    assert between("1 mm", "2 m", 0.5) is None
    assert between("on", "off", 0.5) is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["varies nothing", "[latin_hypercube]"]),
        ("[gird]\na = [1]\n", ["gird", "unknown key", "did you mean grid?"]),
        ("[grid]\na = 1\n", ["grid.a = 1", "a list"]),
        ('[grid]\n"a, b" = [[1, 2, 3]]\n', ["one value for each of its 2 keys"]),
        ('[grid]\n"a, b" = [[1, 1], [1, 2], 1]\n', ["contains a value twice"]),
        ('[latin_hypercube]\nsamples = 2\nranges.a = ["1 mm", "1 mm"]\n', ["ranges.a", "two different values"]),
        ("[grid]\na = [1]\n[settings]\na = 2\n", ["both fixed and varied"]),
        ("[grid]\na = [1]\n[[list]]\na = 2\n", ["a: is given twice"]),
        ("[grid]\n'a, a' = [1]\n", ["a: is given twice"]),
        ("[grid]\na = [1, 2]\n[[list]]\na = 3\nb = 1\n[[list]]\na = 3\nb = 2\n", ["a: is given twice"]),
        ("[[list]]\na = 1\n[[list]]\nb = 1\n", ["is not in all rows"]),
        ('[latin_hypercube]\nsamples = 2\nranges.a = ["1 mm", "1 s"]\n', ["ranges.a", "same unit"]),
        ("[latin_hypercube]\nsamples = 0\nranges.a = [1, 2]\n", ["samples = 0", ">= 1"]),
    ],
)
def test_invalid_study_is_rejected(write, text, words):
    with pytest.raises(CaseError) as caught:
        read_study(write(text))
    assert all(word in str(caught.value) for word in words)


def test_impossible_points_are_rejected_or_skipped(write):
    text = '[grid]\n"package.pitch" = ["0.1 mm", "1 mm"]\n'
    with pytest.raises(PointsError, match=r"point 1 \(package.pitch = 0.1 mm\)"):
        read_points_of(write(text))
    points = read_points_of(write(text, HEAD + "skip_impossible = true\n"))
    assert list(points.possible) == [1]
    rows = results(points, Store(Path("nowhere")), {points.possible[1].key: "stage reflow: no"})
    assert [row.verdict for row in rows] == [IMPOSSIBLE, "failed"]
    assert "pads overlap" in rows[0].message


def test_problem_of_many_points_is_reported_once(write):
    with pytest.raises(PointsError) as caught:
        read_points_of(write(GRID + '[settings]\nshock.duraton = "1 ms"\n'))
    (line,) = caught.value.lines()
    assert "study.toml: point 1 (shock.duraton = 1 ms, package.pitch = 0.9 mm, solder.volume = 0.07 mm^3) and 3" in line
    assert "did you mean shock.duration?" in line


def test_date_is_rejected_as_a_value(write):
    with pytest.raises(PointsError, match="2020-01-01"):
        read_points_of(write("[grid]\nsolder.volume = [2020-01-01]\n"))


def test_shared_products_are_predicted_once(write, tmp_path):
    points = list(read_points_of(write(GRID)).possible.values())
    jobs = list_missing(Store(tmp_path / "store"), points, "report")
    stages = {forecast.stage: forecast for forecast in forecast_stages(points, jobs)}
    assert (stages["geometry"].products, stages["reflow"].products, stages["geometry"].points) == (2, 4, 4)
    expected = sum(stage_seconds(point.case)["reflow"] for point in points)
    assert stages["reflow"].seconds == pytest.approx(expected)


def test_remaining_time_follows_completed_stages():
    assert seconds_left(["a"], {}, 1.0) is None
    assert seconds_left(["a", "a", "b", "c"], {"a": [2.0], "b": [4.0, 6.0]}, 6.0) == pytest.approx(
        (4.0 + 5.0 + 4.0) / 2
    )


def row(number: int, pitch: float, pad: float, stress: float | str | None, verdict: str = HEALTHY) -> Row:
    """Return a row of a study, from pitch [mm], pad volume [mm^3] and stress [Pa]."""
    metrics = {} if stress is None else {"stress": {"value": stress, "unit": "Pa"}}
    settings = {"package.pitch": f"{pitch:g} mm", "solder.volume": f"{pad:g} mm^3"}
    return Row(number, f"key{number}", settings, verdict, seconds=1.0, metrics=metrics)


ROWS = [row(1, 0.9, 0.07, 1.0), row(2, 0.9, 0.0724, 3.0), row(3, 1.0, 0.07, 2.0), row(4, 1.0, 0.0724, 6.0)]


def test_main_effects_are_differences_of_means():
    pitch, volume = (effect_of(Factor((key,)), ROWS, "stress") for key in ("package.pitch", "solder.volume"))
    assert pitch.size == pytest.approx(2.0)
    assert volume.size == pytest.approx(3.0)
    assert [(level.value, level.mean, level.low, level.high) for level in pitch.levels] == [
        ("0.9", 2.0, 1.0, 3.0), ("1", 4.0, 2.0, 6.0),
    ]  # fmt: skip
    assert volume.unit == "mm^3"
    assert volume.rank_correlation == pytest.approx(4.0 / np.sqrt(20.0))  # ranks 1 3 2 4 against 1.5 3.5 1.5 3.5
    trend = effect_of(Factor(("package.pitch",), continuous=True), ROWS, "stress")
    assert trend.size == pytest.approx(2.0)


def test_only_healthy_points_are_ranked():
    rows = [*ROWS, row(5, 1.0, 0.07, 0.5, UNHEALTHY), row(6, 1.0, 0.07, None)]
    assert [point.number for point in rank_parameters(rows, "stress", "minimise")] == [1, 3, 2, 4]
    assert [point.number for point in rank_parameters(rows, "stress", "maximise")] == [4, 2, 3, 1]


def test_csv_and_parquet_have_the_same_columns_with_units(write, tmp_path):
    from pyarrow import parquet

    table = columns([*ROWS, row(5, 1.0, 0.08, None, "failed")], read_study(write(GRID)))
    write_csv(tmp_path / "results.csv", table)
    write_parquet(tmp_path / "results.parquet", table)
    with (tmp_path / "results.csv").open() as file:
        read = list(csv.DictReader(file))
    stored = parquet.read_table(tmp_path / "results.parquet")
    assert stored.column_names == list(read[0])
    assert stored["stress [Pa]"].to_pylist() == [1.0, 3.0, 2.0, 6.0, None]
    assert stored["package.pitch [mm]"].to_pylist() == [0.9, 0.9, 1.0, 1.0, 1.0]
    assert read[1]["stress [Pa]"] == "3.0"
    assert read[4]["stress [Pa]"] == ""


def test_page_has_ranking_effects_and_failures(write, tmp_path):
    from reflowshock.workflow.study.page import write_results

    rows = [*ROWS, row(5, 1.0, 0.08, None, "failed")]
    study = read_study(write(GRID))
    write_results(tmp_path, study, rows)
    page = (tmp_path / "study.html").read_text()
    assert "points/key1/report.html" in page
    assert "1 without a healthy result" in page
    assert "1 of 5 points have no result" in page and not tables.imbalance(ROWS)
    assert "1 of 5 points failed a check" in tables.imbalance([*ROWS, row(5, 1.0, 0.08, 1.0, UNHEALTHY)])
    assert (tmp_path / "main_effects.png").stat().st_size > 10_000
    assert [line[1] for line in tables.ranking(study, rows)["rows"]] == ["key1", "key3", "key2", "key4"]


def row_with_outcome(number: int, settings: dict[str, str], word: str) -> Row:
    """Return a row of a study whose outcome is a word."""
    metrics = {"outcome": {"value": word, "unit": ""}, "stress": {"value": 4e-6 * number, "unit": "m"}}
    return Row(number, f"key{number}", settings, HEALTHY, seconds=1.0, metrics=metrics)


def test_process_map_over_two_factors(write, tmp_path):
    from reflowshock.workflow.study.page import main_effects, write_results

    study = read_study(write(GRID, HEAD + 'metrics = ["outcome"]\n'))
    rows = [row_with_outcome(r.number, dict(r.settings), "merged" if r.number < 3 else "separate") for r in ROWS]
    assert outcomes(study, rows) == ("outcome", rows) and outcomes(study, ROWS) == ("", [])
    axis = process_map(study, "outcome", rows).axes[0]
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("pitch [mm]", "volume [mm^3]")
    drawn = {marks.get_label(): marks.get_offsets().tolist() for marks in axis.collections}
    assert drawn == {"merged": [[0.9, 0.07], [0.9, 0.0724]], "separate": [[1.0, 0.07], [1.0, 0.0724]]}
    assert has_metrics(study, rows) and not has_metrics(
        read_study(write(GRID, HEAD.replace("stress", "outcome"))), rows
    )
    write_results(tmp_path, study, rows)
    assert (tmp_path / "process_map.png").exists() and "Process map" in (tmp_path / "study.html").read_text()
    figure = main_effects(tables.effects(study, rows))
    assert figure.axes[0].get_ylabel() == "stress [µm]"


def test_process_map_over_one_factor_is_a_line_and_over_names_missing(write):
    from reflowshock.workflow.study.page import main_effects

    text = '[grid]\n"package.pitch" = ["0.9 mm", "1 mm"]\n'
    rows = [row_with_outcome(k, {"package.pitch": pitch}, "merged") for k, pitch in ((1, "0.9 mm"), (2, "1 mm"))]
    assert process_map(read_study(write(text)), "outcome", rows).axes[0].get_xlabel() == "pitch [mm]"
    rows = [row_with_outcome(k, {"package.pitch": pitch}, "merged") for k, pitch in ((1, "900 um"), (2, "1000 um"))]
    assert process_map(read_study(write(text)), "outcome", rows).axes[0].get_xlabel() == "pitch [µm]"
    axis = main_effects(tables.effects(read_study(write(text)), rows)).axes[0]
    assert axis.get_xlabel() == "package\npitch [µm]"
    rows = [row_with_outcome(k, {"package.pitch": pitch}, "merged") for k, pitch in ((1, "fine"), (2, "wide"))]
    assert process_map(read_study(write(text)), "outcome", rows) is None


def test_missing_metric_is_reported(write, tmp_path, monkeypatch, capsys):
    points = read_points_of(write('[grid]\n"package.pitch" = ["1 mm"]\n', HEAD.replace("stress", "stres")))
    monkeypatch.setattr("reflowshock.workflow.study.command.list_missing", lambda *_: [])
    monkeypatch.setattr("reflowshock.workflow.study.command.row_of", lambda *_: ROWS[0])
    monkeypatch.setattr("reflowshock.workflow.study.page.write_results", lambda *_: None)
    assert not run_study(points, Store(tmp_path / "store"), Machine(1))
    assert "did you mean stress?" in capsys.readouterr().err


def test_csv_file_contains_no_formula(tmp_path):
    from reflowshock.workflow.study.results import write_csv

    path = tmp_path / "results.csv"
    write_csv(path, {"a": ["=1+1", "+x", "-40 degC", "@x", "\tx", "x"], "b": [-1.0, 2, None, True, "1", "ä"]})
    lines = path.read_text(encoding="utf-8").splitlines()
    assert lines == ["a,b", "'=1+1,-1.0", "'+x,2", "'-40 degC,", "'@x,True", "'\tx,1", "x,ä"]
