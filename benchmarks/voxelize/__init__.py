"""The voxelizer against its peers: the same triangles, one run, one core each. See docs/voxelizing.md."""
