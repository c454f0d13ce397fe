"""Voxelizing: the surface, the interior and the owners of cells."""
