from hypothesis import settings

# Time limits are not tests: compilation or a busy machine would make them fail at random.
settings.register_profile("bimvox", deadline=None)
settings.load_profile("bimvox")
