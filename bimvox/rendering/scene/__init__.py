"""Scenes: the content of a picture, as values."""
