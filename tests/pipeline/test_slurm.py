"""Stages as jobs of a Slurm cluster of one node, which the test starts; skipped with the reason if it cannot start."""

import json
import signal
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import psutil
import pytest

from reflowshock.workflow.jobs.checks import PLUGIN
from tests.support.one_node_slurm import NoSlurm, OneNode, one_node_slurm
from tests.support.warm_start import warm_command
from tests.support.workflow_command import wait_until

STRUCTURE = Path(__file__).parent / "structure.toml"
DROP = Path(__file__).resolve().parents[2] / "cases/sessile_drop/case.toml"
# Two ranks and few steps; the drop takes long enough to be interrupted.
SHORT = ("dynamics.ranks=2", "dynamics.solver=explicit", "dynamics.modes=0", "dynamics.duration=0.02 ms")
LONG = ("drop.particles_per_edge=24",)
TIMES = ("seconds", "per_second", "memory", "wall", "setup")  # parts of the names of metrics that differ between runs


@pytest.fixture(scope="module")
def slurm(tmp_path_factory):
    """Yield a running Slurm cluster."""
    if find_spec(PLUGIN) is None:
        pytest.skip("no Slurm: Snakemake's plugin is not installed (pip install 'reflowshock[cluster]')")
    try:
        with one_node_slurm(tmp_path_factory.mktemp("slurm") / "one") as started:
            yield started
    except NoSlurm as error:
        pytest.skip(f"no Slurm of one node can be started here: {error}")


def command(slurm: OneNode, case: Path, folder: Path, settings: tuple[str, ...], *more: str) -> list[str]:
    """Return the words of a command that runs a case with jobs of Slurm."""
    overrides = [item for setting in settings for item in ("--set", setting)]
    where = ["--executor", "slurm", "--profile", str(slurm.profile)]
    return [sys.executable, "-m", "reflowshock", "run", str(case), "--out", str(folder), *overrides, *where, *more]


def run(slurm: OneNode, line: list[str]) -> subprocess.CompletedProcess:
    """Run a command line in the environment of Slurm; return the completed process."""
    return subprocess.run(line, env=slurm.environment, capture_output=True, text=True, timeout=400, check=False)


def warm_run(slurm: OneNode, line: list[str]) -> subprocess.CompletedProcess:
    """Run a command that submits nothing, without start-up time."""
    return warm_command(*line[3:], environment=slurm.environment)


def metrics(folder: Path) -> dict[str, object]:
    """Return the metrics in the summary of a run folder without timings, name -> value."""
    metrics_by_name = json.loads((folder / "summary.json").read_text())["metrics"]
    return {name: entry["value"] for name, entry in metrics_by_name.items() if not any(word in name for word in TIMES)}


def at_work(folder: Path) -> bool:
    """Return whether a process of Snakemake or a stage works in the store of a run folder."""
    return any(process.info["cwd"] == str(folder / ".store") for process in psutil.process_iter(["cwd"]))


def stage_of(comment: str) -> str:
    """Return the stage of a job; the Snakemake executor writes rule and product in the comment of the job."""
    return comment.removeprefix("rule_").partition("_wildcards_")[0].removesuffix("_on_ranks")


def test_stages_are_jobs_with_ranks_and_products_those_of_a_local_run(slurm, tmp_path):
    line = command(slurm, STRUCTURE, tmp_path / "jobs", SHORT)
    first = run(slurm, line)
    assert first.returncode == 0, first.stdout + first.stderr
    jobs = {stage_of(comment): (state, tasks) for _, state, tasks, comment, _ in slurm.queue()}
    assert jobs == {"geometry": ("COMPLETED", "1"), "shock": ("COMPLETED", "2")}
    said = first.stdout
    assert "shock, explicit solver on 2 ranks" in said
    assert [said.count(f"ok     {stage}") for stage in ("geometry", "shock", "comparison", "report")] == [1] * 4
    assert not list((tmp_path / "jobs").rglob("*.partial"))

    local = [*line[line.index("run") : line.index("--executor")], "--oversubscribe"]
    local[local.index("--out") + 1] = str(tmp_path / "local")
    here = warm_command(*local)
    assert here.returncode == 0, here.stdout + here.stderr
    assert metrics(tmp_path / "jobs") == metrics(tmp_path / "local")

    assert "nothing to do" in warm_run(slurm, line).stdout
    assert len(slurm.queue()) == len(jobs)


@pytest.mark.parametrize("end", [pytest.param(signal.SIGTERM, marks=pytest.mark.long), signal.SIGKILL])
def test_killed_command_leaves_no_job(slurm, tmp_path, end):
    folder = tmp_path / "run"
    before = len(slurm.queue())
    process = subprocess.Popen(
        command(slurm, DROP, folder, LONG), env=slurm.environment, stderr=subprocess.PIPE, start_new_session=True
    )
    wait_until(lambda: [row[1] for row in slurm.queue()[before:]] == ["RUNNING"])
    process.send_signal(end)
    errors = process.communicate(timeout=60)[1]
    assert end == signal.SIGKILL or b"repeat the command to continue" in errors
    wait_until(lambda: [row[1] for row in slurm.queue()[before:]] == ["CANCELLED"])
    wait_until(lambda: not at_work(folder))
    assert not (folder / "reflow").exists()


def test_what_is_impossible_is_said_before_anything_is_submitted(slurm, tmp_path):
    jobs = len(slurm.queue())
    wrong = warm_run(slurm, command(slurm, STRUCTURE, tmp_path / "run", ("dynamics.ranks=64",)))
    assert wrong.returncode == 2
    assert "dynamics.ranks = 64" in wrong.stderr
    assert "partition one has 2 cores" in wrong.stderr
    (tmp_path / "profile").mkdir()
    (tmp_path / "profile/config.yaml").write_text("default-resources: {slurm_partition: onne}\n")
    other = command(slurm, STRUCTURE, tmp_path / "run", SHORT)
    other[other.index("--profile") + 1] = str(tmp_path / "profile")
    wrong = warm_run(slurm, other)
    assert wrong.returncode == 2
    assert (
        'default-resources.slurm_partition = "onne": is not a partition here; allowed: one; did you mean one?'
        in wrong.stderr
    )
    assert not (tmp_path / "run").exists()
    assert len(slurm.queue()) == jobs
