"""Twins where the simulator draws no state twice the same, as Unity does."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from PIL import Image

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.generation.twins.comparison import Difference, World, compare
from infthor_eval.generation.twins.drafting import TwinSettings, draft_twins
from infthor_eval.generation.twins.kinds import Worlds
from infthor_eval.generation.twins.tolerance import EXACT, UNITY, tolerance_of
from infthor_eval.nieh.scoring import score
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import Vector

from ...helpers.trajectories import FORK, cut_trajectory, write_trajectories
from ..questions.logs import history, state
from .test_comparison import TRAJECTORY

GREY = np.full((300, 300, 3), 100, np.uint8)


class NoisySimulator(Simulator):
    """The embedded simulator behind the client; its pictures have noise of one level, so that
    nothing tells what they show before they are drawn."""

    rng = np.random.default_rng(0)

    @property
    def view(self):
        return self._noisy(super().view)

    def step(self, action, imageDigest=False, renderImage=True, **arguments):
        return self._noisy(super().step(action, **arguments))

    def reset(self, scene):
        return self._noisy(super().reset(scene))

    def _noisy(self, view):
        noise = self.rng.integers(-1, 2, view.frame.shape)
        return replace(view, frame=np.clip(view.frame + noise, 0, 255).astype(np.uint8))


def draft(label, folder):
    """A draft of one kind, made with a noisy simulator that is said to be this one."""
    (trajectory,) = iter_trajectories(
        next(write_trajectories(folder / "one", cut_trajectory(FORK, 8)).iterdir())
    )
    out = folder / "set"
    (out / "metadata").mkdir(parents=True)
    strict = partial(score, scorer="strict")
    settings = TwinSettings(("count-open",), 0, 3)
    with NoisySimulator(replace(embedded_launch(), label=label)) as simulator:
        return draft_twins(trajectory, "base", settings, strict, simulator, out), out


def test_noise_is_tolerated_in_unity_and_tells_no_worlds_apart(tmp_path):
    made, out = draft("unity", tmp_path)
    assert made.pairs
    for pair in made.pairs:
        assert 0 < sum(not frame.same for frame in pair.frames) < len(pair.frames) / 2
        first, second = (NiehSet(out, needs_questions=False).frames(name) for name in pair.traj_ids)
        for frame, one, other in zip(pair.frames, first, second, strict=True):
            assert frame.same == (one.path == other.path)


def test_noise_is_not_tolerated_in_the_embedded_simulator(tmp_path):
    made, _ = draft("embedded", tmp_path)
    assert not made.pairs
    reason = "a picture differs though nothing that differs is in view"
    assert made.rejected == {"count-open": {reason: made.proposed["count-open"]}}


@pytest.mark.parametrize(
    ("change", "is_same"),
    [
        (GREY + 1, True),
        (GREY + 2, False),  # light: all of the picture
        (np.where(np.arange(300)[None, :, None] < 1, GREY + 100, GREY), False),  # an edge
    ],
    ids=["noise", "light", "object"],
)
def test_what_is_seen_is_not_tolerated(change, is_same, tmp_path):
    files = tmp_path / "one.png", tmp_path / "other.png"
    Image.fromarray(GREY).save(files[0])
    Image.fromarray(change.astype(np.uint8)).save(files[1])
    assert UNITY.is_same_picture(*files) == is_same
    assert not EXACT.is_same_picture(*files)


@pytest.mark.parametrize(("metres", "is_same"), [(0.005, True), (0.02, False)])
def test_what_unity_moves_by_millimetres_is_at_the_same_place(metres, is_same):
    key = "Mug|1|0|0"
    worlds = Worlds((TRAJECTORY, TRAJECTORY), frozenset(), frozenset())
    first, second = (
        World(history({key: state(key, position=(x, 0.0, 0.0))}).steps, ["a"]) for x in (0, metres)
    )
    displaced = compare(worlds, first, second, UNITY)[1]
    assert displaced == (set() if is_same else {key})
    assert compare(worlds, first, second)[1] == {key}
    assert UNITY.is_same_place(Vector(), Vector(metres)) == is_same
    with pytest.raises(Difference):
        compare(worlds, first, World(second.steps[:0], []), UNITY)


def test_the_simulator_tells_what_is_tolerated():
    assert tolerance_of(Simulator(embedded_launch())) is EXACT
    assert tolerance_of(Simulator(replace(embedded_launch(), label="unity"))) is UNITY
