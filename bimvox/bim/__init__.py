"""Buildings: reading IFC and mesh files into elements with triangles in metres."""
