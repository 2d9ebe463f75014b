"""Solder alone: drops, a joint, drops that merge or oscillate."""
