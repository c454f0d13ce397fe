"""``bimvox crane import``: a machine file from the load charts of a data sheet."""
