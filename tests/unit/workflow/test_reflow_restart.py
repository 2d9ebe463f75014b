"""Restart of a coupled reflow that was killed."""

from types import SimpleNamespace

from reflowshock.meshing.board.pads import pad_table
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.reflow.heated import CouplingFile, all_inputs
from tests.support.workflow_command import SMALL_CASE

HEATED = ["warpage.corner=0 mm", "thermal.peak=245 degC"]


def test_the_file_of_a_changed_case_is_ignored(tmp_path):
    def saved(*settings):
        case = read_case(SMALL_CASE, [*HEATED, *settings])
        return CouplingFile(tmp_path, all_inputs(case, pad_table(case.package, case.board, case.warpage)))

    joints = SimpleNamespace(groups=["present groups"])
    saved().writer(joints)("coupled")
    assert saved().read(joints) == "coupled"
    changes = (
        "materials.die=FR4",
        "thermal.peak=240 degC",
        "board.thickness=1.2 mm",
        "solder.pad_contact_angle=20 deg",
    )
    for change in changes:
        assert saved(change).read(joints) is None, change
