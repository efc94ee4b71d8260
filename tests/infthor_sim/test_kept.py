"""What is kept between replies never shows: a simulator that forgets it answers the same bytes."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from infthor_sim.metadata import Outcome
from infthor_sim.player.server import MetadataPacker

from .harness import Bench
from .test_invariants import PROPERTY, SCENES, STEP, play

SIZE = 60
ALL_PICTURES = {
    "renderInstanceSegmentation": True,
    "renderDepthImage": True,
    "renderSemanticSegmentation": True,
    "renderNormalsImage": True,
}
# Actions after which old pictures or metadata could be taken for new ones, beside those of STEP.
RETURN = st.one_of(
    st.tuples(st.just("SaveState"), st.fixed_dictionaries({"slot": st.integers(0, 1)})),
    st.tuples(st.just("RestoreState"), st.fixed_dictionaries({"slot": st.integers(0, 1)})),
    st.tuples(st.just("RandomizeLighting"), st.just({})),
    st.tuples(st.just("ResetLighting"), st.just({})),
    st.tuples(st.just("RandomizeMaterials"), st.just({})),
    st.tuples(st.just("ToggleMapView"), st.just({})),
    st.tuples(
        st.just("ChangeQuality"), st.sampled_from([{"quality": "Low"}, {"quality": "Ultra"}])
    ),
    st.tuples(st.just("DisableObject"), st.just({})),
    st.tuples(st.just("EnableObject"), st.just({})),
)


def forget(bench: Bench) -> None:
    """Drop all that is kept between replies."""
    sim = bench.sim
    bench.server._packer = MetadataPacker()
    sim._show(sim.world)


def reply_anew(bench: Bench) -> list[tuple[Any, bytes]]:
    """Return what the simulator shows now, made from nothing."""
    forget(bench)
    return shown(bench)


def shown(bench: Bench) -> list[tuple[Any, bytes]]:
    bench.server._outcomes = {0: Outcome("Pass")}
    reply = bench.server._reply(1, {})
    return [(field_type, bytes(body)) for field_type, body in reply]


def act(bench: Bench, step: tuple[str, Any] | tuple[str, int, bool]) -> None:
    if len(step) == 3:
        play(bench, step)
        return
    action, arguments = step
    objects = bench.metadata["objects"]
    if action in {"DisableObject", "EnableObject"}:
        arguments = {"objectId": objects[len(objects) // 2]["objectId"]}
    bench.step(action, **arguments)


@PROPERTY
@given(scene=SCENES, steps=st.lists(st.one_of(STEP, RETURN), min_size=5, max_size=25))
def test_a_simulator_that_keeps_nothing_answers_the_same(scene, steps):
    keeping, forgetting = Bench(size=SIZE), Bench(size=SIZE)
    for bench in (keeping, forgetting):
        bench.reset(scene, **ALL_PICTURES)
    for step in steps:
        act(keeping, step)
        act(forgetting, step)
        assert keeping.frames == forgetting.frames, "the same seed and actions, the same bytes"
        assert shown(keeping) == reply_anew(forgetting), step


def test_a_state_that_comes_back_is_not_taken_for_the_one_left():
    bench = Bench.at("kitchen-1", **ALL_PICTURES, size=SIZE)
    fridge = bench.first("Fridge")
    bench.ok("SaveState")
    closed = shown(bench)
    bench.force("OpenObject", fridge)
    open_ = shown(bench)
    assert open_ != closed
    bench.ok("RestoreState")
    assert [body for _, body in shown(bench)][1:] == [body for _, body in closed][1:]
    bench.force("OpenObject", fridge, openness=0.5)
    half = shown(bench)
    assert half not in (open_, closed)
    assert half == reply_anew(bench)


def test_colours_are_kept_while_nothing_changes():
    bench = Bench.at("kitchen-1", size=SIZE)
    views = bench.sim.views
    first = views.colours(views.agent_frame())
    bench.ok("Pass")
    assert views.colours(views.agent_frame()) is first
    bench.ok("RandomizeLighting", brightness=[0.5, 0.5])
    assert views.colours(views.agent_frame()) is not first
