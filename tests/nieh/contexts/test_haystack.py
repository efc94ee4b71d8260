import gzip
import json
import random
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import SkippedQuestion
from infthor_eval.nieh.contexts import CONTEXTS, ContextSettings, QuestionVariant
from infthor_eval.nieh.contexts.haystack import sampling_pool

from ...helpers.questions import make_question

GOLDEN = Path(__file__).parents[2] / "goldens" / "haystack_multi.jsonl.gz"
DEPTHS = (0, 0.2, 0.4, 0.6, 0.8)


class Frames:
    """A set of one trajectory of so many frames, without files."""

    def __init__(self, n):
        self.all = tuple(FrameRef(f"{index:09d}.png") for index in range(n))

    def frames_until(self, _):
        return self.all

    def clue_positions(self, question):
        return question.clues


def windows(n_frames, clues, seed=0, **settings):
    return CONTEXTS["haystack"].samples(
        Frames(n_frames),
        make_question("t", "Where is it?", "Shelf", clues),
        ContextSettings(seed=seed, **settings),
    )


def published(n_frames, clue, ctx_size, tokens_per_image):
    """The window at each depth, from the definition in the published code's description."""
    n = int(ctx_size * 1000) // tokens_per_image
    windows_by_depth = []
    for d_index in range(5):
        start = clue - d_index * (n // 5)
        inside = start >= 0 and start + n <= n_frames
        windows_by_depth.append(list(range(n_frames))[start : start + n] if inside else None)
    return windows_by_depth


def test_one_clue_gives_the_published_windows_on_a_thousand_random_cases():
    draw = random.Random(5)
    compared = 0
    for _ in range(1000):
        n_frames, ctx_size = draw.randint(1, 2300), draw.choice([8, 16, 32, 64, 128, 256])
        clue, tokens = draw.randrange(n_frames), draw.choice([121, 380, 576, 1485])
        ours = windows(n_frames, [clue], ctx_size=ctx_size, tokens_per_frame=tokens)
        theirs = published(n_frames, clue, ctx_size, tokens)
        assert [
            list(sample.frames) if isinstance(sample, QuestionVariant) else None for sample in ours
        ] == theirs
        assert all(clue in sample.frames for sample in ours if isinstance(sample, QuestionVariant))
        assert [sample.variant for sample in ours] == [f"depth={depth:g}" for depth in DEPTHS]
        compared += sum(window is not None for window in theirs)
    assert compared > 500


def test_several_clues_give_the_published_windows():
    with gzip.open(GOLDEN, "rt") as file:
        cases = [json.loads(line) for line in file]
    n_of = Counter()
    for case in cases:
        n = case["kilo_tokens"] * 1000 // case["tokens_per_frame"]
        sizes = {"ctx_size": case["kilo_tokens"], "tokens_per_frame": case["tokens_per_frame"]}
        sample = windows(case["frames"], case["clues"], **sizes)[case["depth"]]
        clues, frames = (
            set(case["clues"]),
            list(sample.frames) if isinstance(sample, QuestionVariant) else [],
        )
        if case["drawn"]:
            assert sampling_pool(case["clues"], case["frames"], n) == case["pool"]
            assert clues <= set(frames) <= clues | set(case["pool"])
            inside = len(clues & set(case["pool"]))
            assert case["n_drawn"] == n - len(clues)
            assert len(clues) - inside + case["n_drawn"] <= len(frames) <= n
        else:
            assert frames == case["window"]
        n_of[bool(frames), case["drawn"]] += 1
    assert len(cases) == 400
    assert min(n_of[True, True], n_of[True, False], n_of[False, False]) > 50


@given(st.data())
def test_clues_that_are_apart_are_inside_every_window_in_order(data):
    n_frames = data.draw(st.integers(2, 400))
    clues = data.draw(st.lists(st.integers(0, n_frames - 1), min_size=2, max_size=6, unique=True))
    n = data.draw(st.integers(1, 300))
    for sample in windows(n_frames, clues, ctx_size=n, tokens_per_frame=1000):
        if isinstance(sample, SkippedQuestion):
            assert sample.reason
            continue
        assert len(sample.frames) <= n
        assert list(sample.frames) == sorted(set(sample.frames))
        if max(clues) - min(clues) >= len(clues):
            assert set(clues) <= set(sample.frames)


def test_frames_between_several_clues_are_drawn_and_those_around_where_they_are_too_few():
    for sample in windows(100, [40, 50], ctx_size=6, tokens_per_frame=1000):
        assert {40, 50} <= set(sample.frames) <= set(range(40, 51))
        assert len(sample.frames) == 6
    for sample in windows(100, [40, 44], ctx_size=10, tokens_per_frame=1000):
        assert {40, 44} <= set(sample.frames) <= set(range(33, 52))
    assert sampling_pool([40, 44], 100, 10) == list(range(33, 52))


def test_several_clues_are_drawn_from_the_seed_at_each_depth_anew():
    def draw(seed):
        return windows(500, [10, 300], seed=seed, ctx_size=20, tokens_per_frame=1000)

    assert [sample.variant for sample in draw(1)] == [f"depth={depth:g}" for depth in DEPTHS]
    assert len({sample.frames for sample in draw(1)}) == 5
    assert draw(1) == draw(1)
    assert draw(1) != draw(2)


# Windows of clues in a row, by the published function: frames, clues, frames of a window, the
# window at each depth.
IN_A_ROW = [
    (100, (95, 96, 97), 30, [range(71, 100)] * 5),  # ends one frame past the trajectory: 29 frames
    (100, (94, 95, 96), 30, [range(70, 100)] * 5),
    (100, (96, 97, 98), 30, [None] * 5),
    (100, (50, 51, 52), 3, [range(50, 53)] * 5),
    (100, (50, 51, 52), 2, [None] * 5),
    (100, (50, 51), 1, [None] * 5),
    (100, (76, 77), 25, [range(76, 100), *(range(76 - 5 * d, 101 - 5 * d) for d in range(1, 5))]),
    # A put is one needle; its first window may end one frame too late, and is one shorter.
    (100, (50, 51), 10, [range(start, start + 10) for start in (50, 48, 46, 44, 42)]),
    (59, (50, 51), 10, [range(50, 59), *(range(at, at + 10) for at in (48, 46, 44, 42))]),
    (58, (50, 51), 10, [None, *(range(at, at + 10) for at in (48, 46, 44, 42))]),
    # More clues lie at the last depth every time.
    (100, (50, 51, 52), 10, [range(42, 52)] * 5),
    # The smallest and the fullest.
    (10, (4,), 1, [(4,)] * 5),
    (100, (1, 5, 9), 3, [(1, 5, 9)] * 5),
]


@pytest.mark.parametrize(("n_frames", "clues", "n", "expected"), IN_A_ROW)
def test_clues_in_a_row_have_the_published_windows(n_frames, clues, n, expected):
    samples = windows(n_frames, clues, ctx_size=n, tokens_per_frame=1000)
    frames = [sample.frames if isinstance(sample, QuestionVariant) else None for sample in samples]
    assert frames == [window and tuple(window) for window in expected]


def test_a_question_without_a_needle_is_asked_once_outside_the_depths():
    def find_only_sample(n_frames):
        question = make_question(answer="no", clues=(3, 60), absence=True)
        settings = ContextSettings(ctx_size=10, tokens_per_frame=1000)
        (sample,) = CONTEXTS["haystack"].samples(Frames(n_frames), question, settings)
        return sample

    assert find_only_sample(100).variant == find_only_sample(5).variant == "no needle"
    assert find_only_sample(100) == find_only_sample(100)
    assert len(find_only_sample(100).frames) == 10
    assert find_only_sample(100).frames[-1] - find_only_sample(100).frames[0] == 9
    assert find_only_sample(5).reason == "the window reaches outside the trajectory"


@pytest.mark.parametrize(("n_frames", "starts"), [(10, {0}), (11, {0, 1})])
def test_a_window_without_a_needle_lies_anywhere_inside_the_trajectory(n_frames, starts):
    question = make_question(answer="no", clues=(3,), absence=True)
    seeded = (ContextSettings(ctx_size=10, tokens_per_frame=1000, seed=seed) for seed in range(20))
    samples = [
        CONTEXTS["haystack"].samples(Frames(n_frames), question, settings)[0] for settings in seeded
    ]
    assert {sample.frames for sample in samples} == {
        tuple(range(start, start + 10)) for start in starts
    }


def test_what_does_not_fit_says_why():
    def reasons(n_frames, clues, size):
        return {
            skipped.reason
            for skipped in windows(n_frames, clues, ctx_size=size, tokens_per_frame=1000)
        }

    assert reasons(5, [2], 8) == {"the window reaches outside the trajectory"}
    assert reasons(100, [1, 5, 9], 2) == {"the clues do not fit the window"}
    assert reasons(100, [1, 5, 9], 200) == {
        "there are not enough frames between and around the clues"
    }
    assert reasons(100, [1], 0.5) == {"no frame fits the window"}


def test_a_window_without_its_sizes_is_refused():
    with pytest.raises(UsageError, match="needs tokens_per_frame"):
        windows(10, [1], ctx_size=8)
    with pytest.raises(UsageError, match="needs its size"):
        windows(10, [1], tokens_per_frame=121)
