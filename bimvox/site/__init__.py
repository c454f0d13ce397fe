"""The site: components, obstructions, areas, the site file, and the one definition of collision."""
