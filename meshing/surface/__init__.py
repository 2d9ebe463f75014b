"""Closed surfaces of joints: from particles, from a formula, from a user's file."""
