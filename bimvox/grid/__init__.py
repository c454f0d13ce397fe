"""Grids: the metres-to-cells frame, labels, the voxel grid, the summed-area table and the grid file."""
