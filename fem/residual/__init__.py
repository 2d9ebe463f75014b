"""Residual stress of cooling: the static problem, and the state in which a shock begins."""
