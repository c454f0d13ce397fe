"""What a person should look at in a plan that is proven: floating parts, an invented crane, loads for a hand."""
