"""The package and its board during reflow: quasi-static thermoelasticity, and what it makes of the pads."""
