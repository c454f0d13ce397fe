"""Obstructions: files in, cells out."""
