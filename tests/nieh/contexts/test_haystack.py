import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import SkippedQuestion
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import CONTEXTS, ContextSettings, Sample

DEPTHS = (0, 0.2, 0.4, 0.6, 0.8)


class Frames:
    """A set of one trajectory of so many frames, without files."""

    def __init__(self, n):
        self.all = tuple(FrameRef(f"{index:09d}.png") for index in range(n))

    def frames(self, _):
        return self.all

    def clue_frames(self, question):
        return tuple(self.all[index] for index in question.clues)


def question_on(clues):
    return Question("t", "Where is it?", tuple(clues), ("Shelf",))


def windows(n_frames, clues, seed=0, **settings):
    return CONTEXTS["haystack"].samples(Frames(n_frames), question_on(clues), ContextSettings(seed=seed, **settings))


def published(n_frames, clue, ctx_size, tokens_per_image):
    """The window at each depth, from the definition in the published code's description."""
    n = int(ctx_size * 1000) // tokens_per_image
    found = []
    for d_index in range(5):
        start = clue - d_index * (n // 5)
        inside = start >= 0 and start + n <= n_frames
        found.append(list(range(n_frames))[start : start + n] if inside else None)
    return found


def test_one_clue_gives_the_published_windows_on_a_thousand_random_cases():
    draw = random.Random(5)
    compared = 0
    for _ in range(1000):
        n_frames, ctx_size = draw.randint(1, 2300), draw.choice([8, 16, 32, 64, 128, 256])
        clue, tokens = draw.randrange(n_frames), draw.choice([121, 380, 576, 1485])
        ours = windows(n_frames, [clue], ctx_size=ctx_size, tokens_per_frame=tokens)
        theirs = published(n_frames, clue, ctx_size, tokens)
        assert [list(sample.frames) if isinstance(sample, Sample) else None for sample in ours] == theirs
        assert all(clue in sample.frames for sample in ours if isinstance(sample, Sample))
        assert [sample.variant for sample in ours] == [f"depth={depth:g}" for depth in DEPTHS]
        compared += sum(window is not None for window in theirs)
    assert compared > 500


@given(st.data())
def test_every_clue_is_inside_every_window_and_windows_are_full_and_in_order(data):
    n_frames = data.draw(st.integers(2, 400))
    clues = data.draw(st.lists(st.integers(0, n_frames - 1), min_size=2, max_size=6, unique=True))
    n = data.draw(st.integers(1, 300))
    for sample in windows(n_frames, clues, ctx_size=n, tokens_per_frame=1000):
        if isinstance(sample, SkippedQuestion):
            assert sample.reason
            continue
        assert set(clues) <= set(sample.frames)
        assert len(sample.frames) == n
        assert list(sample.frames) == sorted(set(sample.frames))


def test_frames_between_several_clues_come_before_those_around_them():
    (sample,) = windows(100, [40, 50], ctx_size=6, tokens_per_frame=1000)
    assert {40, 50} <= set(sample.frames) <= set(range(40, 51))
    (sample,) = windows(100, [40, 44], ctx_size=10, tokens_per_frame=1000)
    assert set(range(40, 45)) <= set(sample.frames)


def test_several_clues_are_sampled_from_the_seed():
    def draw(seed):
        return windows(500, [10, 300], seed=seed, ctx_size=20, tokens_per_frame=1000)

    assert draw(1) == draw(1)
    assert draw(1) != draw(2)


def test_two_adjacent_clues_are_one_needle():
    samples = windows(100, [50, 51], ctx_size=10, tokens_per_frame=1000)
    assert [sample.variant for sample in samples] == [f"depth={depth:g}" for depth in DEPTHS]
    assert [sample.frames[0] for sample in samples] == [50, 48, 46, 44, 42]
    assert all({50, 51} <= set(sample.frames) for sample in samples)


def test_what_does_not_fit_says_why():
    assert {skipped.reason for skipped in windows(5, [2], ctx_size=8, tokens_per_frame=1000)} == {
        "the window reaches outside the trajectory"
    }
    assert windows(100, [1, 5, 9], ctx_size=2, tokens_per_frame=1000) == [
        SkippedQuestion(question_on([1, 5, 9]), "the clues do not fit the window")
    ]


def test_a_kilo_token_is_the_published_one_unless_told_otherwise():
    def n_frames(context, **settings):
        question = Question("t", "q", (999,), ("a",))
        settings = ContextSettings(ctx_size=8, tokens_per_frame=121, **settings)
        samples = CONTEXTS[context].samples(Frames(1000), question, settings)
        return next(len(sample.frames) for sample in samples if isinstance(sample, Sample))

    assert n_frames("truncate_head") == 8 * 1024 // 121
    assert n_frames("truncate_head", k_tokens=1000) == 8000 // 121
    with pytest.raises(UsageError, match="k_tokens is 1023"):
        ContextSettings.read({"k_tokens": 1023})
    with pytest.raises(UsageError, match="needs tokens_per_frame"):
        windows(10, [1], ctx_size=8)
    with pytest.raises(UsageError, match="needs its size"):
        windows(10, [1], tokens_per_frame=121)
