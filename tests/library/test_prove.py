from bimvox.library.prove import overlap_note
from bimvox.records.lift import ModelledClash


def test_overlapping_parts_are_named_before_their_ids():
    clashes = (ModelledClash("1aB", "2cD", 0.25, None), ModelledClash("1aB", "wall", 0.5, None))
    names = {"1aB": "Column A1 (1aB)", "2cD": "Beam (2cD)"}
    assert overlap_note(clashes, names).startswith(
        "2 pairs of parts overlap in the model, by at most 0.500 m (Column A1 (1aB) and wall)"
    )
    assert "1 pair of parts overlaps" in overlap_note(clashes[:1], names)
