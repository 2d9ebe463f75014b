"""Running a case: reading it, its gate, its stages one by one, what a run folder holds."""
