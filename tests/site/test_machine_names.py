import pytest
from named_cranes import BUILT_IN

from bimvox.errors import InputError
from bimvox.site.catalogue import KINDS, machines_called


def test_machines_are_found_by_kind_and_by_name():
    assert [crane.name for crane in machines_called("mobile")] == ["mobile-60t", "mobile-100t"]
    for crane in BUILT_IN:
        assert [machine.name for machine in machines_called(crane.name)] == [crane.name]
        assert crane.kind in KINDS
        assert crane.name in [machine.name for machine in machines_called(crane.kind)]
    assert len({crane.name for crane in BUILT_IN}) == len(BUILT_IN)


def test_an_unknown_name_is_refused_with_the_one_that_was_meant():
    with pytest.raises(InputError, match=r"did you mean .luffing-40.") as caught:
        machines_called("lufing-40")
    assert "mobile-100t" in str(caught.value.hint)
