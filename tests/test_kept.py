import gc
from dataclasses import dataclass
from weakref import ref

from bimvox.kept import kept


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Owner:
    name: str


def test_it_is_computed_once_per_object_and_other_arguments():
    calls = []

    @kept
    def named(owner: Owner, number: int) -> str:
        calls.append((owner.name, number))
        return f"{owner.name} {number}"

    one, alike = Owner("one"), Owner("one")
    assert named(one, 1) is named(one, 1)
    assert named(one, 2) == "one 2"
    assert named(alike, 1) == "one 1"
    assert calls == [("one", 1), ("one", 2), ("one", 1)]


def test_it_is_released_with_its_object():
    class Result:
        pass

    @kept
    def result(owner: Owner) -> Result:
        return Result()

    owner = Owner("one")
    found = ref(result(owner))
    assert found() is result(owner)
    del owner
    gc.collect()
    assert found() is None
