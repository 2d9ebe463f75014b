"""Structures as a kind of case: stages, forecast, what their motion is compared with, report."""
