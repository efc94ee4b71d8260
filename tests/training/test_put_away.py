"""A replayed trajectory in which something is put away as a task of its own, as training
sequences."""

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.object_ids import Words
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.plans.history.segments import restart_at, segment_parts
from infthor_eval.training.data import read_history

from ..helpers.trajectories import write_trajectories
from ..plans.put_away import PEN, pen_put_away


def test_it_is_a_plan_with_its_goal(tmp_path, encoder, simulator):
    data = write_trajectories(tmp_path / "data", pen_put_away())
    replayed = replay_set(select([data]), simulator, tmp_path / "set")
    assert not replayed.failures
    _, history = read_history(
        NiehSet(tmp_path / "set", needs_questions=False), PEN, Words.PUBLISHED
    )
    assert [segment.goal for segment in history if segment.goal is not None] == [
        "look at a pen under the desk lamp",
        "put the Pen on the DiningTable",
        "look at a mug under the floor lamp",
    ]
    away = history[4]
    assert (away.plan, away.in_task) == ("put the Pen in the DiningTable", True)
    assert len(away.steps) == 22
    assert away.steps[-1][0] == "PutObject Pen DiningTable"
    alone = encoder.actions(PEN, segment_parts(restart_at(history, 4, 5)))
    text = encoder._tokenizer.decode([piece for piece in alone.pieces if isinstance(piece, int)])
    assert text.startswith("<|goal|>Your main goal: put the Pen on the DiningTable<|goal|>")
