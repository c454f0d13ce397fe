"""Emergency stops: braking, holding and resuming."""
