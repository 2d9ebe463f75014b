"""All kinds of flow. To add one, write its file next to `dam_break.py` and list its record here."""

from reflowshock.workflow.flows.dam_break import DAM_BREAK
from reflowshock.workflow.flows.droplet import DROPLET
from reflowshock.workflow.flows.flow_kind import FlowCase, FlowKind
from reflowshock.workflow.flows.poiseuille import POISEUILLE
from reflowshock.workflow.flows.printing import PRINTING
from reflowshock.workflow.flows.taylor_green import TAYLOR_GREEN

FLOWS = (DAM_BREAK, POISEUILLE, TAYLOR_GREEN, DROPLET, PRINTING)


def flow_of(case: FlowCase) -> FlowKind:
    """Return the description of a flow case's kind: its solver, limits, cost and charts.

    Args:
        case: Case of a flow, such as a dam break or a droplet.
    """
    return next(flow for flow in FLOWS if flow.case is type(case))
