"""Reading IFC files."""
