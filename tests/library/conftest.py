from rough_search import models_are_read_once  # noqa: F401  (a fixture)
