"""Pictures: a voxel ray-caster and what it draws."""
