"""Obstructions: from files to cells."""
