"""Pictures, animations and plots: what is drawn, and how it becomes pixels."""
