"""The sketches of the docs: small drawings that explain the rules of the engine. ``make sketches`` writes them."""
