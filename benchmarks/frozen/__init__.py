"""Recorded SHA-256 of what the program writes, to check that refactoring does not change it."""
