import pytest

from bimvox.crane.catalogue import BUILT_IN, KINDS, machines_called
from bimvox.errors import InputError


def test_machines_are_found_by_kind_and_by_name():
    assert [crane.name for crane in machines_called("mobile")] == ["mobile-60t", "mobile-100t"]
    for crane in BUILT_IN:
        assert machines_called(crane.name) == (crane,)
        assert crane in KINDS[crane.kind]
    assert len({crane.name for crane in BUILT_IN}) == len(BUILT_IN)


def test_an_unknown_name_is_refused_with_the_one_that_was_meant():
    with pytest.raises(InputError, match=r"did you mean .luffing-40.") as caught:
        machines_called("lufing-40")
    assert "mobile-100t" in str(caught.value.hint)
