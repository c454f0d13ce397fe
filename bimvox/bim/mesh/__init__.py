"""Reading mesh files."""
