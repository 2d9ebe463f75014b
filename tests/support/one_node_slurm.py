"""Slurm cluster of one node: munged, slurmctld and slurmd on loopback addresses, with all files in one folder."""

import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "srun", "squeue", "sinfo", "scancel", "scontrol")
CONFIGURATION = """\
ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/filetxt
JobCompLoc={folder}/jobs.txt
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
KillWait=2
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory={memory}
PartitionName=one Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""
PROFILE = """\
slurm-status-command: squeue
slurm-init-seconds-before-status-checks: 8
latency-wait: 10
"""


class NoSlurm(RuntimeError):
    """Slurm cannot be started here; the message gives the reason."""


@dataclass(frozen=True)
class OneNode:
    """Running Slurm: its folder, the environment of its commands, and a Snakemake profile."""

    folder: Path
    environment: dict[str, str]
    profile: Path

    def ask(self, *command: str) -> str:
        return subprocess.run(
            command, env=self.environment, capture_output=True, text=True, timeout=60, check=True
        ).stdout

    def ended(self) -> list[dict[str, str]]:
        """Return the records of ended jobs as key -> value, with the rule of each job."""
        path = self.folder / "jobs.txt"
        lines = path.read_text().splitlines() if path.is_file() else []
        return [dict(word.split("=", 1) for word in line.split() if "=" in word) for line in lines]

    def queue(self) -> list[list[str]]:
        """Return number, state, tasks, comment and working folder of each job in the order of submission."""
        rows = self.ask("squeue", "--noheader", "--states=all", "--format=%A|%T|%C|%k|%Z").splitlines()
        return sorted((row.split("|") for row in rows), key=lambda job: int(job[0]))


@contextmanager
def one_node_slurm(folder: Path) -> Iterator[OneNode]:
    """Start a Slurm cluster of this machine, yield it, and stop it at the end.

    Raises:
        NoSlurm: If a program is missing, the user is not root, or a daemon does not start.
    """
    missing = [program for program in PROGRAMS if shutil.which(program, path=_path()) is None]
    if missing:
        raise NoSlurm(f"not installed: {', '.join(missing)} (Debian: slurmctld slurmd slurm-client munge)")
    if os.geteuid() != 0:
        raise NoSlurm("slurmd starts jobs as root only")
    folder.mkdir(parents=True)
    environment = {name: value for name, value in os.environ.items() if not name.startswith("SLURM_")}
    environment |= {"SLURM_CONF": str(folder / "slurm.conf"), "PATH": _path()}
    started: list[subprocess.Popen] = []
    try:
        _start(folder, environment, started)
        (folder / "profile").mkdir()
        (folder / "profile/config.yaml").write_text(PROFILE)
        yield OneNode(folder, environment, folder / "profile")
    finally:
        _stop(started)


def _path() -> str:
    return f"{os.environ['PATH']}:/usr/sbin:/sbin"


def _start(folder: Path, environment: dict[str, str], started: list[subprocess.Popen]) -> None:
    host = socket.gethostname().split(".")[0]
    memory = psutil.virtual_memory().total // 2**20
    text = CONFIGURATION.format(folder=folder, host=host, ports=_free_ports(2), memory=memory)
    (folder / "slurm.conf").write_text(text)
    for name in ("state", "spool"):
        (folder / name).mkdir()
    key = folder / "munge.key"
    key.write_bytes(os.urandom(1024))
    key.chmod(0o600)
    munged = [f"--{name}={folder}/munge.{ending}" for name, ending in MUNGE_FILES]
    commands = (
        ["munged", "--foreground", "--force", *munged],
        ["slurmctld", "-D", "-c"],
        ["slurmd", "-D", "-N", host],
    )
    for command in commands:
        with (folder / f"{command[0]}.said").open("w") as said:
            daemon = subprocess.Popen(command, env=environment, stdout=said, stderr=said, start_new_session=True)
        started.append(daemon)
        if command[0] == "munged":
            _wait(lambda: (folder / "munge.socket").exists(), daemon, folder, "munged")
    _wait(lambda: "idle" in _sinfo(environment), started[-1], folder, "slurmd")


MUNGE_FILES = (
    ("key-file", "key"), ("socket", "socket"), ("pid-file", "pid"), ("log-file", "log"), ("seed-file", "seed")
)  # fmt: skip


def _sinfo(environment: dict[str, str]) -> str:
    answer = subprocess.run(["sinfo", "-h", "-o", "%T"], env=environment, capture_output=True, text=True, check=False)
    return answer.stdout


def _wait(ready, daemon: subprocess.Popen, folder: Path, name: str, seconds: float = 20.0) -> None:
    deadline = time.monotonic() + seconds
    while not ready():
        if daemon.poll() is not None or time.monotonic() > deadline:
            said = "".join(
                path.read_text() for path in (folder / f"{name}.said", folder / f"{name}.log") if path.exists()
            )
            raise NoSlurm(f"{name} does not start: {said.strip()[-500:] or 'it says nothing'}")
        time.sleep(0.1)


def _stop(started: list[subprocess.Popen]) -> None:
    for daemon in reversed(started):
        daemon.terminate()
        try:
            daemon.wait(10)
        except subprocess.TimeoutExpired:
            daemon.kill()
            daemon.wait()


def _free_ports(count: int) -> list[int]:
    sockets = [socket.socket() for _ in range(count)]
    for listener in sockets:
        listener.bind(("127.0.0.1", 0))
    ports = [listener.getsockname()[1] for listener in sockets]
    for listener in sockets:
        listener.close()
    return ports
