"""Every exporter: plans and grids in other formats; ``formats`` has the table of them."""
