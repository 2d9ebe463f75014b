"""Profile of a cluster: a folder with Snakemake options that users set once."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from reflowshock.names import find_nearest
from reflowshock.problem import Problem
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.toml_file import MOST_BYTES, fault_of

OWN = Path("profiles/slurm")  # the user's profile, relative to the working directory
SHIPPED = Path(__file__).parents[1] / "profiles/slurm"
FILE = "config.yaml"
KEYS = ("launcher", "walltime_factor")


@dataclass(frozen=True, slots=True)
class Profile:
    """Values of a cluster profile that the program uses; Snakemake reads the rest of the file.

    Attributes:
        folder: Folder of the file.
        partition: Partition of the jobs; empty for the default of the cluster.
        launcher: Command line that starts MPI ranks within a job.
        walltime_factor: Factor on the requested wall time.
    """

    folder: Path
    partition: str = ""
    launcher: str = "mpirun"
    walltime_factor: float = 1.0


def read_profile(folder: Path | None) -> Profile:
    """Read a profile.

    Args:
        folder: Folder of the profile; None for the user's ``profiles/slurm`` or, if missing, the shipped one.

    Returns:
        Partition of the jobs, launcher of MPI ranks, and factor on the requested wall time.

    Raises:
        CaseError: The file is missing or unreadable, or a value is invalid.
    """
    folder = folder or (OWN if (OWN / FILE).is_file() else SHIPPED)
    path = folder / FILE
    fault = fault_of(path, MOST_BYTES) if path.exists() else ""
    if fault:
        raise _wrong(path, Problem("", fault))
    try:
        table = yaml.safe_load(path.read_text(encoding="utf-8")) or {}
    except FileNotFoundError as error:
        raise _wrong(path, Problem("--profile", "is not a profile", str(folder), f"a folder with {FILE}")) from error
    except (OSError, ValueError, RecursionError, yaml.YAMLError) as error:
        raise _wrong(path, Problem("", f"cannot be read: {error}")) from error
    config = _table(path, table, "config")
    resources = _table(path, table, "default-resources")
    for key in config:
        if key not in KEYS:
            message = Problem(f"config.{key}", "unknown key", config[key], ", ".join(KEYS), find_nearest(key, KEYS))
            raise _wrong(path, message)
    launcher = str(config.get("launcher", "mpirun"))
    if not _is_command(launcher):
        raise _wrong(path, Problem("config.launcher", "is not a command", launcher, "mpirun, srun --mpi=pmix, …"))
    partition = str(resources.get("slurm_partition", "")).strip("'\"")
    return Profile(folder, partition, launcher, _factor(path, config.get("walltime_factor", 1.0)))


def _is_command(text: str) -> bool:
    try:
        return bool(shlex.split(text))
    except ValueError:  # a quote is open
        return False


def _factor(path: Path, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.1 <= value <= 1000.0:
        raise _wrong(path, Problem("config.walltime_factor", "is not a factor", value, "0.1 to 1000"))
    return float(value)


def _table(path: Path, table: object, key: str) -> Mapping[str, Any]:
    value = table.get(key, {}) if isinstance(table, dict) else None
    if not isinstance(value, dict):
        raise _wrong(path, Problem(key, "must be a table of keys and values", None, "lines KEY: VALUE"))
    return value


def _wrong(path: Path, problem: Problem) -> CaseError:
    return CaseError(str(path), [problem])
