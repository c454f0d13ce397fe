"""Every exporter: plans and grids in other formats."""
