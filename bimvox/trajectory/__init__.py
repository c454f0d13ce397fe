"""Trajectories: from voxel stairs to timed crane motion and commands."""
