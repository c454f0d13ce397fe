"""The construction site of Zhu, Pauwels and de Vries (2021) as an environment, single and batched.

Columns and beams lie in a yard; one after the other hangs in transit and is moved, a voxel at a time, to its place.
"""
