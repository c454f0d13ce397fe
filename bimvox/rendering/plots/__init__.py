"""Plots in one style, readable in greyscale and by colour-blind people."""
