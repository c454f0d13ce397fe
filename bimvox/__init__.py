"""bimvox: from a building model to lifts that a crane can drive."""

__version__ = "0.1.0"
