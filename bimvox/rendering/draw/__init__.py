"""From a scene to pixels: a voxel ray caster, boxes, strokes, outlines and words."""
