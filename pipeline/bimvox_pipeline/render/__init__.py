"""``bimvox render``."""
