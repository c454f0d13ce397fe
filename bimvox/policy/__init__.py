"""Policies: training (the only place that imports torch and stable-baselines3), storage and inference."""
