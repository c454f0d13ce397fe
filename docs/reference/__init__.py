"""Writes the pages that follow from the code, ``make docs``: one a command, one a format."""
