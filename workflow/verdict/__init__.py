"""Verdict on a dropped package: criteria with sources, of which the smallest margin decides. See `criteria.py`."""
