"""Measurements: not part of the package, run with make."""
