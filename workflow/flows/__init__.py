"""Flows of a liquid by delta-SPH: one file for each kind (`dam_break.py`, ...), all listed in `registry.py`.

Start with `flow_kind.py`: a `FlowKind` is everything that distinguishes one flow from another. The stage, forecast,
report and convergence study are shared and take such a record.
"""
