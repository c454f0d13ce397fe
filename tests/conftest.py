import os

# One worker of the tests a core: further threads of a library would only wait for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")

from hypothesis import settings

# Time limits are not tests: compilation or a busy machine would make them fail at random.
settings.register_profile("bimvox", deadline=None)
settings.load_profile("bimvox")
