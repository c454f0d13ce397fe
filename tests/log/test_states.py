from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from log_building import tiny_plan

from bimvox.log.scene import StatesAtStarts, states_before
from bimvox.records.lift import Lift, Status, YardPlace
from bimvox.records.track import LiftTimes
from bimvox.site.component import ConstructionState, StoredPose

UNBUILT, ASSEMBLED = ConstructionState.UNBUILT, ConstructionState.ASSEMBLED
SHAPE = tiny_plan().site.components[0].shape


def test_the_yard_holds_one_delivery_at_a_time() -> None:
    lifts = tiny_plan().lifts
    assert states_before(lifts, 0) == {0: UNBUILT, 1: UNBUILT}
    assert states_before(lifts, 2) == {0: ASSEMBLED, 2: UNBUILT}


@st.composite
def plans(draw: st.DrawFn) -> tuple[list[Lift], list[LiftTimes]]:
    """Lifts of any status and delivery, and tracks of planned ones, several of which may be under way at a time."""
    lifts = []
    for order in range(draw(st.integers(1, 8))):
        status = draw(st.sampled_from([*Status, *[Status.PLANNED] * 4]))
        delivery, stack = draw(st.integers(0, 3)), draw(st.integers(0, 1))
        place = YardPlace(delivery, StoredPose.AS_BUILT, SHAPE, (0, 0, 1), stack=stack)
        known = place if status is Status.PLANNED or draw(st.booleans()) else None
        other = status is Status.INFEASIBLE and draw(st.booleans())
        lifts.append(Lift(7 - order, order, known, status, by_other_means=other))
    carried = [lift for lift in lifts if lift.status is Status.PLANNED and draw(st.integers(0, 3))]
    times = [sorted(draw(st.lists(st.integers(0, 4), min_size=5, max_size=5))) for _ in carried]
    tracks = [LiftTimes(lift, *times_ns) for lift, times_ns in zip(carried, times, strict=True)]
    return lifts, sorted(tracks, key=lambda track: track.start_ns)


@given(plans())
def test_states_at_starts_are_those_of_their_definition(plan: tuple[list[Lift], list[LiftTimes]]) -> None:
    lifts, tracks = plan
    starts, shown, begun = StatesAtStarts(lifts, tracks), {}, {}
    changes = [(time_ns, track, state) for track in tracks for time_ns, state in track.states]
    for time_ns, track, state in sorted(changes, key=lambda change: change[0]):
        begun[track.lift.component] = state
        if state is not UNBUILT:
            shown[track.lift.component] = state
            continue
        shown |= starts.begin(track)
        shown = {component: state for component, state in shown.items() if state is not None}
        wanted = states_before(lifts, track.lift.order) | begun
        for other in tracks:
            if other.start_ns > time_ns and wanted.get(other.lift.component) is ASSEMBLED:
                wanted[other.lift.component] = UNBUILT
        assert shown == wanted
