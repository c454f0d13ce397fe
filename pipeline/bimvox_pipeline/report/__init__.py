"""``bimvox report``."""
