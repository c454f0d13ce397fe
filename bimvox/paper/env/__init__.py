"""The construction site of Zhu, Pauwels and de Vries (2021) as an environment, single and batched.

Columns and beams lie in a yard. One after the other is hoisted and moved, a voxel at a time, to its place.
"""
