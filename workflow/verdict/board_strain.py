"""Largest strain of the board under the package against the user's limit.

IPC/JEDEC-9704 is not built in: its formula was found in no two public texts, and revision A (2012) gives no limits.
"""

from reflowshock.workflow.verdict.criterion import Criterion, JudgedDrop, Judgement

METRIC = "peak_board_strain"


class BoardStrain(Criterion):
    """Largest strain of an element of the board under the package."""

    name = "board_strain"
    words = "board strain"
    formula = "largest strain <= limit"
    valid = "loads that the source of the limit covers"

    def judge(self, drop: JudgedDrop) -> Judgement:
        """Judge the largest strain of the run."""
        value, limit = drop.value(METRIC), drop.failure.board_strain
        if limit is None or value is None:
            why = (
                "needs shock.failure.board_strain.limit; IPC/JEDEC-9704 is left out, because its formula was not found"
                " in two public texts and its revision A of 2012 dropped the limits"
            )
            return Judgement(self.name, value=value, unit="m/m", why=why)
        return Judgement(self.name, limit.source, value, limit.limit, "m/m")
