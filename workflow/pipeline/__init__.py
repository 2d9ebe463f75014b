"""Pipeline of a case: reading, checks before a run, stages, report."""
