"""Ranks: who has what, messages, checkpoints, and what happens when one fails."""
