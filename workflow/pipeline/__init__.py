"""Reading a case and running its stages: the gate, one stage after the other, the report."""
