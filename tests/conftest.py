from hypothesis import settings

# A time is never a test: what compiles, or a busy machine, would fail it now and then.
settings.register_profile("bimvox", deadline=None)
settings.load_profile("bimvox")
