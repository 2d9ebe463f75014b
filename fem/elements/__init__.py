"""The family of elements."""
