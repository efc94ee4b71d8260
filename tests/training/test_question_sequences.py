"""Questions with their answers: asked as in the evaluation, loss on the answer alone."""

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.formats.question import Question
from infthor_eval.nieh.samples import find_samples
from infthor_eval.training.data import question_sequences
from infthor_eval.training.encoding import Encoder, SkippedSequence, TrainingSequence
from infthor_eval.training.starting_model import load_starting_model
from model_adapters import Turn


def build(encoder, root, context="clues", limit=100_000, **settings):
    samples = find_samples({"data": str(root), "context": context, **settings})
    return list(question_sequences(encoder, samples, limit))


@pytest.fixture(scope="session")
def chat_tiny():
    return load_starting_model("qwen2.5-vl-tiny", {}, "chat", seed=0)


def test_questions_are_asked_as_the_evaluation_asks_them(bundled_set, chat_tiny, plain_tiny):
    samples = find_samples({"data": str(bundled_set), "context": "clues"})
    for loaded in (chat_tiny, plain_tiny):
        encoder = Encoder(loaded)
        sequences = build(encoder, bundled_set)
        assert len(sequences) == len(samples.samples) > 100
        for sequence, sample in zip(sequences, samples.samples, strict=True):
            context, text = samples.request(sample)
            prompt = encoder._prompter.pieces([Turn("user", (*context, text))])
            assert list(sequence.pieces[: len(prompt)]) == prompt
            reply = sequence.pieces[len(prompt) :]
            assert sequence.has_loss == (False,) * len(prompt) + (True,) * len(reply)
            assert reply[-1] == loaded.tokenizer.convert_tokens_to_ids("<|im_end|>")
            answers = ", ".join(map(str, sample.question.answers))
            assert loaded.tokenizer.decode(reply[:-1]) == answers


def test_what_cannot_be_asked_is_told(make_nieh_set, encoder):
    asked = ((1, "yes"), (77, "no"))
    root = make_nieh_set([Question("traj_a", "Is it?", (at,), (answer,)) for at, answer in asked])
    built = build(encoder, root)
    sequence, left = sorted(built, key=lambda item: isinstance(item, SkippedSequence))
    assert isinstance(sequence, TrainingSequence)
    assert "clue 77 is outside" in left.reason
    (short, *_) = build(encoder, root, "trajectory", limit=100)
    assert "longer than 100 tokens" in {
        short.reason,
        *(item.reason for item in build(encoder, root, limit=100)),
    }


def test_a_memory_cannot_be_trained_on(make_nieh_set, encoder):
    with pytest.raises(UsageError, match="training has no memory"):
        build(encoder, make_nieh_set(), "memory", memory="notes")
