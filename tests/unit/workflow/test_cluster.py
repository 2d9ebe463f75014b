"""Stages as jobs of a cluster, without one: profile, what jobs ask for, what is checked, what is shown."""

import sys
from pathlib import Path

import pytest

from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.jobs import checks
from reflowshock.workflow.jobs import checks as queue
from reflowshock.workflow.jobs.checks import Partition, jobs_in, partitions
from reflowshock.workflow.jobs.engine import JobOutput, failures_of
from reflowshock.workflow.jobs.executor import ExecutorName, Local, Slurm, executor_for
from reflowshock.workflow.jobs.profile import FILE, SHIPPED, Profile, read_profile
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.resources import stage_resources
from reflowshock.workflow.process.launch import LAUNCHER, mpi_command

CASES = Path(__file__).resolve().parents[3] / "cases"
SNAKEMAKE_LOG = """\
rule shock:
    jobid: 2

[Sun Nov 22 03:33:12 2026]
Error in rule shock:
    message: SLURM-job '7' failed, SLURM status is: 'TIMEOUT'. Reason: Unknown.For further error details see the log.
    jobid: 2
    output: batch/done/shock-1
Error in rule reflow:
    message: SLURM sbatch failed. The error message was 'sbatch: error: Memory specification can not be satisfied
sbatch: error: Batch job submission failed'.
    sbatch call:
        sbatch --parsable
    jobid: 1
    output: batch/done/reflow-2

[Sun Nov 22 03:33:13 2026]
Error in rule surface:
    message: None
    jobid: 3
    output: batch/done/surface-3
"""


def case(name: str, *settings: str):
    """Return a case of the checkout with settings."""
    return read_case(CASES / name / "case.toml", settings, oversubscribe=True)


def test_ranks_and_cores_of_a_package_become_tasks():
    resources = stage_resources(case("bga_drop", "shock.ranks.total=6", "reflow.ranks=5"))
    assert list(resources) == ["geometry", "reflow", "surface", "solder_mesh", "shock"]
    assert {stage: resource.tasks for stage, resource in resources.items() if resource.tasks > 1} == {
        "reflow": 5,
        "shock": 6,
    }
    assert resources["shock"].of_rule("srun --mpi=pmix")["mpi"] == "srun --mpi=pmix"
    assert "mpi" not in resources["geometry"].of_rule("mpirun")
    alone = stage_resources(case("bga_drop"), cores=4)
    assert (alone["reflow"].tasks, alone["reflow"].cpus_per_task) == (1, 4)


def test_walltime_and_memory_follow_what_plan_foresees():
    small, large = (stage_resources(case("bga_drop", f"shock.duration={time}"))["shock"] for time in ("1 ms", "100 ms"))
    assert small.runtime < large.runtime
    assert stage_resources(case("bga_drop"), 2.0)["geometry"].runtime == 20
    fine = stage_resources(case("hu_bga_drop"))["shock"]
    assert stage_resources(case("bga_drop"))["shock"].mem_mb < fine.mem_mb < 8000


def test_each_kind_of_case_has_jobs():
    assert list(stage_resources(case("sessile_drop"))) == ["reflow"]
    board = stage_resources(case("jedec_board", "dynamics.ranks=3"))
    assert {stage: resource.tasks for stage, resource in board.items()} == {"geometry": 1, "shock": 3}


def test_the_profile_that_comes_along_can_be_read():
    assert read_profile(SHIPPED) == Profile(SHIPPED)


def test_profile_of_the_user(tmp_path, monkeypatch):
    folder = tmp_path / "profiles/slurm"
    folder.mkdir(parents=True)
    (folder / FILE).write_text(
        "default-resources: {slurm_partition: long}\nconfig: {launcher: srun --mpi=pmix, walltime_factor: 2}\n"
    )
    monkeypatch.chdir(tmp_path)
    profile = read_profile(None)
    assert (profile.partition, profile.launcher, profile.walltime_factor) == ("long", "srun --mpi=pmix", 2.0)
    assert Slurm(profile).environment == {LAUNCHER: "srun --mpi=pmix"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("config: {luncher: mpirun}", "config.luncher = \"mpirun\": unknown key; allowed: launcher, walltime_factor"),
        ("config: {launcher: ''}", "config.launcher"),
        ("config: {launcher: mpirun 'x}", "config.launcher = \"mpirun 'x\": is not a command"),
        ("config: {walltime_factor: -1}", "walltime_factor = -1: is not a factor; allowed: 0.1 to 1000"),
        ("config: [launcher=srun]", "config: must be a table"),
        ("a: b: c", "cannot be read"),
    ],
)  # fmt: skip
def test_wrong_profiles_are_reported(tmp_path, text, said):
    (tmp_path / FILE).write_text(text)
    with pytest.raises(CaseError) as error:
        read_profile(tmp_path)
    assert said in str(error.value)


def test_a_folder_without_profile_is_reported(tmp_path):
    with pytest.raises(CaseError, match="is not a profile"):
        read_profile(tmp_path / "nowhere")


def test_a_profile_is_nothing_for_this_machine(tmp_path):
    assert executor_for(ExecutorName.LOCAL, None, 3, False, []) == Local(3)
    with pytest.raises(CaseError, match="--executor slurm"):
        executor_for(ExecutorName.LOCAL, tmp_path, 3, False, [])


def test_missing_programs_are_reported_before_anything_runs(monkeypatch):
    monkeypatch.setattr(checks.shutil, "which", lambda _: None)
    monkeypatch.setattr(checks, "find_spec", lambda _: None)
    with pytest.raises(CaseError) as error:
        executor_for(ExecutorName.SLURM, SHIPPED, None, False, [])
    assert "sbatch is not installed here" in str(error.value)
    assert "pip install 'reflowshock[cluster]'" in str(error.value)


def program(folder: Path, name: str, body: str) -> None:
    """Write an executable Python program to a folder."""
    path = folder / name
    path.write_text(f"#!{sys.executable}\n{body}\n")
    path.chmod(0o755)


def test_partitions_and_jobs_of_a_folder(tmp_path, monkeypatch):
    program(tmp_path, "sinfo", "print('short|0/64/0/64|32\\nlong*|8/0/56/64|64+\\nshort|0/16/0/16|16')")
    program(tmp_path, "squeue", f"print('7 {tmp_path}\\n8 /elsewhere')")
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    assert partitions() == [Partition("short", 80, 32, False), Partition("long", 64, 64, True)]
    assert jobs_in(tmp_path) == ["7"]
    monkeypatch.setattr(checks, "_missing", lambda: ())
    with pytest.raises(CaseError, match="asks for 70 MPI ranks, but the Slurm partition long has 64 cores"):
        checks.check_slurm(Profile(tmp_path), [case("bga_drop", "shock.ranks.total=70")])
    program(tmp_path, "sinfo", "pass")
    with pytest.raises(CaseError, match="no Slurm partition"):
        checks.check_slurm(Profile(tmp_path), [])
    program(tmp_path, "sinfo", "raise SystemExit('sinfo: error: no controller')")
    with pytest.raises(queue.NoAnswer, match="no controller"):
        partitions()


def test_what_jobs_say_is_shown_as_it_comes(tmp_path, capfd):
    log = tmp_path / "shock-1.txt"
    output = JobOutput([tmp_path / "reflow-1.txt", log])
    output.show()
    log.write_text("  shock on 2 ranks …\nhalf")
    output.show()
    log.write_text("  shock on 2 ranks …\nhalf a line\n")
    output.show()
    assert capfd.readouterr().out == "  shock on 2 ranks …\nhalf a line\n"


def test_jobs_that_ended_silently_are_reported(tmp_path):
    said = tmp_path / "snakemake.txt"
    assert failures_of(said) == {}
    said.write_text("WorkflowError: the account is invalid")
    assert failures_of(said) == {}
    said.write_text(SNAKEMAKE_LOG)
    assert failures_of(said) == {
        "shock-1": "SLURM-job '7' failed, SLURM status is: 'TIMEOUT'. Reason: Unknown.",
        "reflow-2": "SLURM sbatch failed. The error message was 'sbatch: error: Memory specification can not"
        " be satisfied\nsbatch: error: Batch job submission failed'.",
    }


def test_launcher_of_mpi_ranks_is_a_choice(monkeypatch):
    assert mpi_command(2, ["program"], False)[0] == "mpirun"
    monkeypatch.setenv(LAUNCHER, "srun --mpi=pmix --overlap")
    assert mpi_command(2, ["program"], True) == ["srun", "--mpi=pmix", "--overlap", "-n", "2", "program"]
