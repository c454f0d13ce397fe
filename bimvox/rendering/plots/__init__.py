"""Plots of figures: one look, readable in gray and by the colour-blind."""
