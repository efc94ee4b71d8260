"""Which questions the small model learns to read from, and which frames they show."""

import random
import re
from collections import Counter

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.household.wording import canonical_type, object_type
from infthor_eval.nieh.samples import find_samples
from infthor_eval.training.data import question_sequences
from infthor_eval.training.encoding import Encoder
from recipes.nano.architecture import build_untrained
from recipes.nano.reading.asking import Asker, question_intro
from recipes.nano.reading.episodes import read_episodes
from recipes.nano.reading.question_sampler import QuestionSampler
from recipes.nano.reading.renaming import Vocabulary
from recipes.nano.seeing.units import Units
from recipes.nano.seen_objects import SeenFrame, read_seen_frames
from recipes.nano.settings import NanoRecipe, ReadingSettings
from recipes.nano.stages import corpus_texts

from ....helpers.twin_sets import CLUES, write_twin_set

RECORDED = {"synthetic": 0.0, "events": 0.0, "single": 0.0}  # no others
RECIPE = NanoRecipe(title="small", hidden=40, layers=1, threads=1)


@pytest.fixture(scope="module")
def seen(small_set):
    return read_seen_frames([small_set])


@pytest.fixture(scope="module")
def units(seen):
    objects = [one for _, in_frame in seen for one in in_frame]
    return Units({one.type for one in objects} | {one.parent for one in objects if one.parent})


@pytest.fixture(scope="module")
def vocabulary(seen):
    objects = [one for _, in_frame in seen for one in in_frame]
    held = {one.type for one in objects if one.is_held}
    places = {one.parent for one in objects if one.parent} - {"Floor"}
    return Vocabulary(held, places - held, {one.type for one in objects})


@pytest.fixture(scope="module")
def loaded(small_set, units):
    return build_untrained(RECIPE, corpus_texts([small_set], units.types), [question_intro()])


@pytest.fixture(scope="module")
def make(loaded, units, vocabulary, seen):
    """Makes a sampler of questions of some sets."""

    def make_sampler(*folders, frames=seen, **settings):
        episodes, skipped = read_episodes(folders)
        assert not skipped
        asker = Asker(Encoder(loaded), episodes[0].worlds[0].frames[0])
        mix = ReadingSettings(**settings)
        return QuestionSampler(asker, episodes, frames, vocabulary, units, mix)

    return make_sampler


@pytest.fixture(scope="module")
def texts(loaded):
    """Returns the question and the answer of each branch of a sequence."""

    def read(sequence):
        tokens = sequence.tokens
        told = [
            loaded.tokenizer.decode([one for one in tokens.pieces[span] if isinstance(one, int)])
            for span in tokens.spans[1:]
        ]
        pattern = re.compile(r"Question: (.*\?)(.*)<\|im_end\|>")
        return [pattern.search(text).groups() for text in told]

    return read


def test_a_question_as_recorded_has_the_prompt_of_evaluation(small_set, make, loaded):
    settings = {
        **RECORDED,
        "recalled": 0.0,
        "whole": 0.0,
        "renamed": 0.0,
        "turned": 0.0,
    }
    sampler = make(small_set, **settings, together=1, filled=0)
    task = find_samples({"data": str(small_set), "context": "clues"})
    evaluated = {
        sequence.pieces for sequence in question_sequences(Encoder(loaded), task, limit=9999)
    }
    drawn = sampler.draw(random.Random(0), 1.0)
    assert len(drawn) > 3
    # lists of objects are sorted for training: any order is right
    unordered = [one for one in drawn if one.tokens.pieces not in evaluated]
    assert len(unordered) < len(drawn) / 4


def test_at_first_questions_are_on_single_frames(small_set, make):
    sampler = make(small_set, single=0.5)
    early, late = (
        [one.tokens for _ in range(8) for one in sampler.draw(random.Random(7), progress)]
        for progress in (0.2, 1.0)
    )
    assert {len(one.frames) for one in early} == {1}
    assert max(len(one.frames) for one in late) > 5


def test_renamed_frames_show_what_the_renamed_questions_ask_for(
    small_set, make, texts, seen, units
):
    """What is there under its new name was there under its old one."""
    sampler = make(small_set, renamed=1.0, single=1.0, tokens_per_step=9000)
    types = {frame.digest: {canonical_type(one.type) for one in inside} for frame, inside in seen}
    found = Counter()
    for one in sampler.draw(random.Random(0), 0.0):
        (frame,) = one.tokens.frames
        assert sorted(frame.order) == [*range(len(units.types))]
        for question, answer in texts(one):
            asked = re.fullmatch(
                r"(?:Have you seen an? (.+)|Is there any (.+) in this room)\?", question
            )
            if asked is None:
                continue
            old = units.types[frame.order[units.index(object_type(asked[1] or asked[2]))]]
            assert (old in types[frame.digest]) == (answer == "yes")
            found[answer] += 1
    assert min(found["yes"], found["no"]) > 10


def test_both_worlds_of_twins_are_asked_on_the_same_frames_by_number(tmp_path, make, texts):
    twin_set = write_twin_set(tmp_path / "twins")
    data = NiehSet(twin_set)
    views = [data.frames(name) for name in {question.traj_id for question in data.questions}]
    frames = [SeenFrame(frame, ()) for view in views for frame in view]
    settings = {
        **RECORDED,
        "recalled": 0.0,
        "whole": 0.0,
        "filled": 0,
    }
    sampler = make(twin_set, frames=frames, **settings, renamed=0.5, tokens_per_step=3000)
    drawn = sampler.draw(random.Random(0), 1.0)
    for first, second in zip(drawn[::2], drawn[1::2], strict=True):
        for one in (first, second):
            shown = [frame.digest for frame in one.tokens.frames]
            assert any(shown == [view[at].digest for at in CLUES] for view in views)
        orders = {
            getattr(frame, "order", None) for one in (first, second) for frame in one.tokens.frames
        }
        assert len(orders) == 1
        for (question, answer), (same, other) in zip(texts(first), texts(second), strict=True):
            assert question == same
            assert answer != other


def test_whole_trajectories_have_all_frames_and_what_happened(small_set, make):
    sampler = make(small_set, **RECORDED, whole=1.0, tokens_per_step=1)
    (one,) = sampler.draw(random.Random(0), 1.0)
    assert len(one.events) == len(one.tokens.frames) > 40
    assert one.events[0] is None
    assert any(one.events[1:])


def test_the_same_random_numbers_draw_the_same_questions(small_set, make):
    sampler = make(small_set)
    one, other = (sampler.draw(random.Random(3), 0.7) for _ in range(2))
    assert one == other


@pytest.mark.parametrize("wrong", [{"together": 0}, {"whole": 1.5}, {"ramp": 0.0}])
def test_settings_out_of_range_are_refused(wrong):
    (name,) = wrong
    with pytest.raises(ValueError, match=name):
        ReadingSettings(**wrong)
