"""List of all failure criteria; a new criterion is a class with ``judge`` and a row here."""

from reflowshock.workflow.verdict.board_deflection import BoardDeflection
from reflowshock.workflow.verdict.board_strain import BoardStrain
from reflowshock.workflow.verdict.criterion import Criterion
from reflowshock.workflow.verdict.joint_limits import DropLife, JointLimit
from reflowshock.workflow.verdict.ratios import RATIOS, ReferenceRatio

JOINT_LIMITS = (
    JointLimit("peel_stress", "peel"),
    JointLimit("layer_von_mises", "von Mises"),
    JointLimit("layer_plastic_work", "plastic work"),
)
CRITERIA: tuple[Criterion, ...] = (
    *JOINT_LIMITS,
    DropLife(),
    BoardDeflection(),
    BoardStrain(),
    *(ReferenceRatio(metric) for metric in RATIOS),
)
BY_NAME = {criterion.name: criterion for criterion in CRITERIA}
