"""Stress test: fixed and random hard cases, each checked against bounds."""
