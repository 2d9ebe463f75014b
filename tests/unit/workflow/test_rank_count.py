"""Ranks that the program chooses: as many as there are idle cores, within the limits of the case."""

import pytest

from reflowshock.fem.errors import RankError
from reflowshock.fem.estimates.placement import check_size
from reflowshock.fem.problem.shock import Ranks
from reflowshock.workflow.jobs import batch
from reflowshock.workflow.process import rank_count
from reflowshock.workflow.process.environment import group_cores
from reflowshock.workflow.process.launch import LAUNCHER
from reflowshock.workflow.process.rank_count import core_times, decide_ranks, idle_between, idle_cores

STAT = """cpu  30 0 10 200 10 0 0 0 0 0
cpu0 10 0 5 100 5 0 0 0 0 0
cpu1 20 1 5 100 5 2 3 4 0 0
intr 12 3
"""


@pytest.fixture(autouse=True)
def no_launcher(monkeypatch):
    monkeypatch.delenv(LAUNCHER, raising=False)


@pytest.mark.parametrize(
    ("idle", "cores", "ranks"),
    [(2.0, 2, 2), (1.6, 2, 2), (1.4, 2, 1), (0.0, 2, 1), (8.0, 8, 2), (1.0, 8, 1)],
)
def test_a_busy_core_costs_a_rank(monkeypatch, idle, cores, ranks):
    monkeypatch.setattr(rank_count, "idle_cores", lambda: idle)
    decided = decide_ranks(1, 2, cores)
    assert decided.ranks == ranks
    assert f"{idle:.1f} cores idle" in str(decided)
    assert decide_ranks(2, 2, cores).ranks == 2
    assert str(decide_ranks(3, 3, cores)) == "3 ranks"


def test_nothing_is_measured_where_nothing_is_to_be_decided(monkeypatch):
    monkeypatch.setattr(rank_count, "idle_cores", lambda: pytest.fail("measured"))
    assert decide_ranks(4, 4, 2).ranks == 4
    assert str(decide_ranks(1, 2, 1)) == "1 rank (1 core for this run)"
    monkeypatch.setenv(LAUNCHER, "srun")
    assert decide_ranks(1, 2, 1).ranks == 2


def test_idle_time_of_cores(monkeypatch, tmp_path):
    path = tmp_path / "stat"
    path.write_text(STAT)
    monkeypatch.setattr(rank_count, "STAT", path)
    before = core_times()
    assert before == {0: (105, 120), 1: (105, 140)}
    after = {0: (125, 140), 1: (110, 160)}
    assert idle_between(before, after, {0, 1}) == pytest.approx(1.25)
    assert idle_between(before, before, {0, 7}) == 2.0
    monkeypatch.setattr(rank_count, "STAT", tmp_path / "absent")
    assert core_times() == {}


def test_idle_cores_of_this_machine():
    assert 0.0 <= idle_cores(0.05) <= 4096


@pytest.mark.parametrize(
    ("files", "cores"),
    [
        ({"cpu.max": "150000 100000\n"}, 1.5),
        ({"cpu.max": "max 100000\n"}, 1e9),
        ({"cpu/cpu.cfs_quota_us": "50000\n", "cpu/cpu.cfs_period_us": "100000\n"}, 0.5),
        ({"cpu/cpu.cfs_quota_us": "-1\n", "cpu/cpu.cfs_period_us": "100000\n"}, 1e9),
        ({"cpu.max": "broken\n"}, 1e9),
        ({}, 1e9),
    ],
)
def test_cores_of_a_container(tmp_path, files, cores):
    (tmp_path / "cpu").mkdir()
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    assert group_cores(tmp_path) == cores


def test_limits_on_the_number_of_ranks():
    assert (Ranks().least, Ranks().most) == (1, 2)
    assert (Ranks(total=5).least, Ranks(total=5).most) == (5, 5)
    assert Ranks(placement="disjoint", macro=1).least == 2
    for size in (1, 2, 3):
        check_size(Ranks(), size)
    for ranks, size in ((Ranks(placement="disjoint"), 1), (Ranks(total=2), 1)):
        with pytest.raises(RankError):
            check_size(ranks, size)
    with pytest.raises(ValueError, match="leaves no rank"):
        Ranks(placement="disjoint", macro=2)


class Shock:
    """Job of a shock that has one or two ranks."""

    stage, ranks, least_ranks = "shock", 2, 1

    @property
    def point(self):
        """Itself, with itself as case."""
        return self

    case = point


def test_several_shocks_at_a_time_have_one_core_each():
    job, machine = Shock(), batch.Machine(cores=2)
    assert batch._threads(job, [job], machine, {}) == 2
    assert batch._threads(job, [job, Shock()], machine, {}) == 1
    assert batch._threads(job, [job], batch.Machine(cores=1), {}) == 1
