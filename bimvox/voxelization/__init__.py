"""Voxelizing: surface, interior and ownership of cells."""
