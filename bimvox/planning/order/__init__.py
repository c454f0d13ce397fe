"""The erection sequence."""
