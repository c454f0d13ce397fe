"""Animations of a plan."""
