"""A run interrupted anywhere, at any time, by any signal, ends with the results of an undisturbed one.

A reported success is real: after any interrupt, the repeated command computes the missing products.
"""

import json
import random
import shutil
import signal
import subprocess
import time

import psutil
import pytest

from tests.support.faults import SEED, answers
from tests.support.workflow_command import command_line, reflowshock

COUNT = 50
STAGE_START = 1.0  # [s] for the start of a process
CHANGED = ("shock.peak_acceleration=1000 G",)
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
ROUNDING = 1e-6
EXACTLY_ZERO, OF_ROUNDING = ("error", "residual"), 1e-9  # figures that are zero except for rounding, relative to 1
HEED = ("env", "--default-signal=INT")  # background jobs of a shell ignore SIGINT


@pytest.fixture(scope="module")
def undisturbed(first_run):
    """Return the folder, and the duration of its stages with their start."""
    folder, ended = first_run
    assert ended.returncode == 0, ended.stdout + ended.stderr
    seconds = json.loads((folder / "summary.json").read_text())["timings"]["wall"].values()
    return folder, sum(seconds) + STAGE_START * len(seconds)


def same(actual: dict[str, object], expected: dict[str, object]) -> None:
    """Check that two runs have the same metrics, up to rounding."""
    assert actual.keys() == expected.keys()
    for name, value in expected.items():
        if isinstance(value, float):
            least = OF_ROUNDING if any(word in name for word in EXACTLY_ZERO) else 1e-12
            assert actual[name] == pytest.approx(value, rel=ROUNDING, abs=least), name
        else:
            assert actual[name] == value, name


def whom(process: subprocess.Popen, choice: random.Random) -> list[psutil.Process]:
    """Return the command or a process of its Snakemake, stage, launcher or MPI ranks."""
    children = psutil.Process(process.pid).children(recursive=True)
    return [choice.choice([psutil.Process(process.pid), *children])]


@pytest.mark.long  # part of the interrupted run is in tests/pipeline/test_pipeline.py
@pytest.mark.parametrize("number", range(COUNT))
def test_a_run_that_was_broken_off_goes_on_to_the_same_answer(undisturbed, tmp_path, number):
    choice = random.Random(f"{SEED} {number}")
    expected, seconds = undisturbed
    line = [*HEED, *command_line("run", tmp_path / "small")]
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(choice.uniform(0.5, seconds))
    chosen = choice.choice(SIGNALS)
    if process.poll() is None:
        children = psutil.Process(process.pid).children(recursive=True)
        for victim in whom(process, choice):
            victim.send_signal(chosen)
        process.wait(timeout=120)
        assert psutil.wait_procs(children, timeout=20)[1] == []
    result = reflowshock("run", tmp_path / "small")
    assert result.returncode == 0, f"seed {SEED}, {number}: {result.stdout}{result.stderr}"
    same(answers(tmp_path / "small"), answers(expected))
    assert reflowshock("verify", tmp_path / "small").returncode == 0


@pytest.mark.parametrize("end", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)])
def test_an_old_result_is_never_reported_as_a_new_one(undisturbed, tmp_path, end):
    """A complete run, a changed one interrupted in its shock, and the changed one repeated."""
    folder = tmp_path / "small"
    shutil.copytree(undisturbed[0], folder)
    line = [*HEED, *command_line("run", folder, settings=CHANGED)]
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 100.0
    while not list(folder.glob(".store/work/shock-*/.shock.partial/two_scale/input.json")):
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.02)
    process.send_signal(end)
    assert process.wait(timeout=60) == 1
    assert not (folder / "report.html").exists() and not (folder / "summary.json").exists()
    result = reflowshock("run", folder, settings=CHANGED)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "ok     shock" in result.stdout
    ratio = answers(folder)["peak_board_strain"] / answers(undisturbed[0])["peak_board_strain"]
    assert ratio == pytest.approx(1000 / 1500, rel=0.05)
    back = reflowshock("run", folder)
    assert "nothing to do" in back.stdout
    assert answers(folder) == answers(undisturbed[0])
