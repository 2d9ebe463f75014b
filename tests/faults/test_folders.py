"""Folders of any name, folders of other users, and names that lead elsewhere."""

import os
import shutil
import subprocess
import sys

import pytest

from reflowshock.workflow.jobs.engine import SNAKEFILE
from tests.support.faults import DROP, SMALL_DROP, run_drop
from tests.support.warm_start import warm_command
from tests.support.workflow_command import wait_until

ODD = "Drop test #3: a\n\"b' {c} [/x] $(touch pwned) %d *é;\\ -e"


def test_a_folder_of_any_name_will_do(tmp_path):
    folder = tmp_path / ODD / "run"
    for words in ("ok     reflow", "nothing to do"):
        result = run_drop(folder, cwd=tmp_path)
        assert result.returncode == 0, result.stdout + result.stderr
        assert words in result.stdout
    assert (folder / "report.html").is_file()
    assert [path.name for path in tmp_path.iterdir()] == [ODD.partition("/")[0]]
    for command in ("status", "verify", "plan", "report", "clean"):
        result = run_drop(folder, command, cwd=tmp_path)
        assert result.returncode == 0, command + result.stdout + result.stderr
    assert not folder.exists()


def test_products_of_another_time_are_products(drop_folder):
    """Modification times do not matter, neither in the future nor of copies."""
    folder = drop_folder
    for path in (folder / ".store/products").rglob("*"):
        os.utime(path, (4e9, 4e9))
    assert "nothing to do" in run_drop(folder).stdout
    other = run_drop(folder, "run", "--until", "reflow", "--set", "drop.contact_angle=70 deg")
    assert other.returncode == 0, other.stderr
    assert "ok     reflow" in other.stdout


def test_an_unusable_folder_is_reported_before_anything_runs(tmp_path):
    (tmp_path / "file").write_text("mine")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/notes.txt").write_text("mine")
    long = "/".join(["d" * 200] * 25)
    for out, words in (
        ("file", "is not a folder"),
        ("mine", "contains files"),
        (".", "contains files"),
        ("/", "contains files"),
    ):
        result = run_drop(out, "plan", cwd=tmp_path)
        assert result.returncode == 2 and words in result.stderr
    for command, code in (("plan", 2), ("run", 2), ("status", 1), ("clean", 2)):
        result = run_drop(long, command, cwd=tmp_path)
        assert result.returncode == code, command
        assert result.stderr.count("\n") == 1 and "ile name too long" in result.stderr
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["file", "mine", "notes.txt"]


def test_a_report_does_not_replace_a_users(tmp_path):
    """With missing products the report is not a product, and a user's file in its place is set aside."""
    folder = tmp_path / "run"
    assert run_drop(folder, "run", "--until", "reflow").returncode == 0
    (folder / "report.html").write_text("mine")
    for path in folder.glob(".store/products/reflow-*"):
        shutil.rmtree(path)
    for _ in range(2):
        assert run_drop(folder, "report").returncode == 0
        assert (folder / "report.html.kept-1").read_text() == "mine"
        assert (folder / "report.html").read_text().startswith("<!")
        assert not (folder / "report.html.kept-2").exists()
    (folder / "report.html").unlink()
    verified = run_drop(folder, "verify")
    assert verified.returncode == 1 and f"{folder}/report.html is missing" in verified.stderr


@pytest.mark.parametrize("name", ["../../esc", "a/b", "..", ".", "a\n", "x" * 5000, "/etc", "-x y"])
def test_names_do_not_lead_out_of_a_folder(tmp_path, name):
    text = f'[scales."{name}"]\n'.replace("\n", "\\n", name.count("\n"))
    case = tmp_path / "case.toml"
    case.write_text(DROP.read_text() + "\n" + text + '"drop.particles_per_edge" = 5\n')
    result = warm_command("run", str(case), "--set", f"scale={name}", *SMALL_DROP, cwd=tmp_path)
    assert result.returncode == 2, result.stdout + result.stderr
    assert len(result.stderr) < 2000
    assert [path.name for path in tmp_path.iterdir()] == ["case.toml"]


@pytest.mark.long
def test_plain_snakemake_holds_the_folder_and_shows_no_old_report(drop_folder, tmp_path):
    folder = drop_folder
    line = [sys.executable, "-m", "snakemake", "-s", str(SNAKEFILE), "--cores", "1", "--config", f"case={DROP}"]
    line += [f"out={folder}", 'set=["drop.particles_per_edge=5", "solder.numerics.max_steps=1"]']
    dry = subprocess.run([*line, "-n"], capture_output=True, text=True, timeout=60, check=False, cwd=tmp_path)
    assert dry.returncode == 0 and (folder / "report.html").exists()
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=tmp_path)
    wait_until(lambda: list(folder.glob(".store/work/reflow-*/.reflow.partial")) or process.poll() is not None)
    assert process.poll() is None
    assert not (folder / "report.html").exists()
    assert "another run is active" in run_drop(folder).stderr
    assert process.wait(timeout=60) == 1
    assert not (folder / "report.html").exists()
    assert "nothing to do" in run_drop(folder).stdout and (folder / "report.html").exists()
