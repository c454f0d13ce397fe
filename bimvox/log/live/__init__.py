"""The log while a plan is carried out."""
