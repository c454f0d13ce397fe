"""Braking, holding and going on."""
