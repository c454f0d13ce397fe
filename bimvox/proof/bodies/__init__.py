"""How deep bodies of triangles reach into each other, and which cells they fill.

- ``triangles``: the check of neighbours along a path; ``overlap``: how deep two bodies overlap
- ``solid``, ``solid_queries``, ``triangle_tree``: a body, and whether points, segments and triangles are inside it
- ``filled``: whether a part fills the cells that it claims
"""
