"""``Sequence-v0``: whole buildings whose erection sequence and crane assignment are to be found."""
