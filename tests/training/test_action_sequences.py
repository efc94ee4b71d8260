"""Windows of a history: what is in them, where loss is taken, and that agents are asked with the
same tokens."""

import itertools
import re

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.step_log import read_steps
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.household.sequence_text import ACT
from infthor_eval.plans.history.segments import PlanSegment, segment_parts
from infthor_eval.training.action_sequences import recorded_segments, windows
from infthor_eval.training.encoding import SkippedSequence, TrainingSequence
from model_adapters.hf.prompting.prompt import Frame

from ..helpers.prompts import join_parts
from .twins import trained_texts

_ACTION = re.compile(r"<\|act\|>(.*?)<\|act\|>")


def segments_of(root, name):
    data, folder = NiehSet(root), root / "metadata" / name
    (trajectory,) = iter_trajectories(folder / "traj_data.json")
    return recorded_segments(trajectory, read_steps(folder), data.frames(name), Words.PUBLISHED)


def names_in(root):
    return sorted(path.name for path in (root / "metadata").iterdir())


def test_a_recorded_history_says_what_the_replay_wrote(bundled_set):
    for name in names_in(bundled_set):
        parts = segment_parts(segments_of(bundled_set, name))
        written = (bundled_set / "metadata" / name / "traj.txt").read_text().strip()
        assert join_parts(parts) == written
        frames = [part for part in parts if isinstance(part, FrameRef)]
        all_frames = NiehSet(bundled_set).frames(name)
        # One frame per action, the last one of it, and the first; those at the start of a task come
        # again.
        assert set(frames) <= set(all_frames)
        in_order = sorted(set(frames), key=lambda frame: frame.path)
        assert [frame for frame, _ in itertools.groupby(frames)] == in_order


def test_windows_have_every_action_once_and_each_begins_as_a_trajectory_does(bundled_set, encoder):
    for name in names_in(bundled_set)[:3]:
        history = segments_of(bundled_set, name)
        goals = {segment.goal for segment in history}
        windows_of_history = list(windows(encoder, name, history, 5000))
        assert len(windows_of_history) > 1
        assert all(window.n_tokens <= 5000 for window in windows_of_history)
        for window in windows_of_history:
            ids = [piece for piece in window.pieces if isinstance(piece, int)]
            text = encoder._tokenizer.decode(ids)
            goal = re.match(r"<\|goal\|>Your main goal: (.*?)<\|goal\|>", text)
            assert goal[1] in goals
        actions = [text for window in windows_of_history for text in trained_texts(encoder, window)]
        done = [action for segment in history for action, _ in segment.steps]
        assert actions == [f"{ACT}{action}{ACT}" for action in done]


def test_windows_cannot_hold_another_plan(bundled_set, encoder):
    name = names_in(bundled_set)[0]
    history = segments_of(bundled_set, name)
    windows_of_history = list(windows(encoder, name, history, 5000))
    ends = itertools.accumulate(window_plans(window) for window in windows_of_history)
    for window, end in zip(windows_of_history[:-1], ends, strict=False):
        more = encoder.pieces(list(history[end].parts()))
        n_more = sum(1 if isinstance(piece, int) else len(piece.ids) for piece in more)
        assert window.n_tokens + n_more > 5000


def window_plans(window):
    numbers = [int(number) for number in re.findall(r"\d+", window.name.rpartition(", plan")[2])]
    return numbers[-1] - numbers[0] + 1


def test_a_plan_that_is_too_long_is_left_out_and_told(bundled_set, encoder):
    name = names_in(bundled_set)[0]
    history = segments_of(bundled_set, name)
    least = min(len(segment.steps) for segment in history)
    limit = 150 + least * 130
    windows_of_history = list(windows(encoder, name, history, limit))
    left = [item for item in windows_of_history if isinstance(item, SkippedSequence)]
    kept = [item for item in windows_of_history if isinstance(item, TrainingSequence)]
    assert left
    assert {item.reason for item in left} == {f"longer than {limit} tokens"}
    assert len(left) + sum(map(window_plans, kept)) == len(history)


def test_an_agent_is_asked_with_what_it_was_trained_on(bundled_set, encoder):
    """By the model's own prompts: an agent's at each action is the window up to the mark that opens
    it."""
    name = names_in(bundled_set)[1]
    history = segments_of(bundled_set, name)[:3]
    parts = segment_parts(history)
    window = encoder.actions(name, parts)
    opens = [at for at, piece in enumerate(window.pieces) if piece == encoder._mark][::2]
    requests = [
        at for at, part in enumerate(parts) if isinstance(part, str) and part.startswith(ACT)
    ]
    assert len(opens) == len(requests)
    for place, at in zip(opens, requests, strict=True):
        assert encoder.pieces([*parts[:at], ACT]) == list(window.pieces[: place + 1])


def test_ids_and_labels_of_a_short_history(tmp_path, encoder, bundled_set):
    first, second = NiehSet(bundled_set).frames(names_in(bundled_set)[0])[:2]
    segment = PlanSegment("go to the sink", "wash a mug", first, (("MoveAhead", second),))
    window = encoder.actions("one", [*segment.parts()])
    ids = encoder._tokenizer
    goal, plan, act = ids.convert_tokens_to_ids(["<|goal|>", "<|plan|>", ACT])
    start, end = ids.convert_tokens_to_ids(["<|vision_start|>", "<|vision_end|>"])
    wash, go, move = (
        ids(text)["input_ids"]
        for text in ("Your main goal: wash a mug", "Plan: go to the sink", "MoveAhead")
    )
    expected = [goal, *wash, goal, start, first, end, plan, *go, plan]
    trained = [act, *move, act]
    pieces = [piece.ref if isinstance(piece, Frame) else piece for piece in window.pieces]
    assert pieces == [*expected, *trained, start, second, end]
    assert window.has_loss == (False,) * len(expected) + (True,) * len(trained) + (False,) * 3
    assert (window.n_loss_tokens, len(window.frames)) == (len(trained), 2)


def test_a_text_that_holds_a_mark_is_refused(encoder, bundled_set):
    first, second = NiehSet(bundled_set).frames(names_in(bundled_set)[0])[:2]
    segment = PlanSegment(f"go {ACT}", "goal", first, (("MoveAhead", second),))
    with pytest.raises(DataError, match=r"bad: a goal, a plan or an action contains <\|act\|>"):
        encoder.actions("bad", [*segment.parts()])


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(lengths=st.lists(st.integers(1, 12), min_size=1, max_size=12), limit=st.integers(200, 4000))
def test_windows_of_any_history(lengths, limit, encoder, bundled_set):
    frame = NiehSet(bundled_set).frames(names_in(bundled_set)[0])[0]
    history = [
        PlanSegment(
            f"plan {number}",
            f"goal {number}" if number % 3 == 0 else None,
            frame,
            (("MoveAhead", frame),) * length,
        )
        for number, length in enumerate(lengths)
    ]
    windows_of_history = list(windows(encoder, "any", history, limit))
    kept = [item for item in windows_of_history if isinstance(item, TrainingSequence)]
    assert all(window.n_tokens <= limit for window in kept)
    assert sum(map(window_plans, kept)) + len(windows_of_history) - len(kept) == len(history)


def test_a_sequence_of_130k_tokens_is_built_and_its_labels_are_right(bundled_set, encoder):
    frames = NiehSet(bundled_set).frames(names_in(bundled_set)[0])
    actions = ("MoveAhead", "RotateLeft", "PickupObject Mug", "PutObject Mug Fridge", "LookDown")
    cycle = zip(itertools.cycle(actions), itertools.cycle(frames))
    history = [
        PlanSegment(f"plan {number}", goal, frames[0], tuple(itertools.islice(cycle, 11)))
        for number, goal in enumerate(["goal", *[None] * 99])
    ]
    window, *rest = windows(encoder, "long", history, 131_072)
    assert 128_000 < window.n_tokens <= 131_072
    assert len(rest) == 1
    text = join_parts(segment_parts(history[: window_plans(window)]))
    done = [f"{ACT}{action}{ACT}" for action in _ACTION.findall(text)]
    assert trained_texts(encoder, window) == done  # and no frame, which has no text
