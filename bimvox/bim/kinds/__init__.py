"""What a part is: the one place that decides its kind."""
