"""``bimvox inspect``."""
