"""Environments: actions, dynamics, reward, observation; single (Gymnasium) and batched."""
