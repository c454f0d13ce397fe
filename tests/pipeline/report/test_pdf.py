from bimvox_pipeline.report import same_each_time

PDF = b"/CreationDate (D:%b+00'00') /ID (node%08d) /ID (node%08d) /Names [(node%08d) 1 0 R (node%08d) 2 0 R]"


def test_dates_and_browser_counters_are_removed():
    one = same_each_time(PDF % (b"20261121235959", 76, 81, 76, 81))
    other = same_each_time(PDF % (b"20261122000001", 61, 63, 61, 63))
    assert one == other
    assert len(one) == len(PDF % (b"20261121235959", 76, 81, 76, 81))
    assert one.count(b"(node00000001)") == one.count(b"(node00000002)") == 2
    assert b"D:19800101000000" in one
