"""Which questions the small model is trained on, and which frames they show."""

import random
from collections import defaultdict
from dataclasses import replace

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.contexts import CONTEXTS
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.samples import find_samples
from infthor_eval.training.encoding import Encoder
from infthor_eval.training.nano.architecture import build_untrained, image_processor
from infthor_eval.training.nano.frame_dataset import read_frame_dataset
from infthor_eval.training.nano.question_sampler import QuestionSampler, question_intro
from infthor_eval.training.nano.sampler import corpus_texts
from infthor_eval.training.nano.settings import NanoRecipe, QuestionSettings
from infthor_eval.training.question_sequences import question_sequences

from ...helpers.twin_sets import CLUES, write_twin_set

RECIPE = NanoRecipe(title="small", hidden=32, layers=1, threads=1)
LIMIT = 2048


@pytest.fixture(scope="module")
def dataset(small_set):
    return read_frame_dataset([small_set], image_processor(RECIPE.vision.grid), RECIPE.vision.grid)


@pytest.fixture(scope="module")
def twin_set(tmp_path_factory):
    return write_twin_set(tmp_path_factory.mktemp("twins") / "set")


@pytest.fixture(scope="module")
def loaded(small_set, dataset):
    return build_untrained(RECIPE, corpus_texts([small_set], dataset.types), [question_intro()])


@pytest.fixture(scope="module")
def make(loaded, dataset):
    """Makes a sampler of questions of some sets."""

    def make_sampler(*folders, **settings):
        mix = QuestionSettings(**settings)
        return QuestionSampler(Encoder(loaded), folders, dataset, mix, LIMIT)

    return make_sampler


@pytest.fixture(scope="module")
def read(loaded):
    """Returns a sequence's text, without its frames."""

    def read_text(pieces):
        return loaded.tokenizer.decode([piece for piece in pieces if isinstance(piece, int)])

    return read_text


def test_a_question_has_the_prompt_of_evaluation(small_set, make, loaded):
    sampler = make(small_set, synthetic=0.0, recalled=0.0, per_step=30, together=1)
    task = find_samples({"data": str(small_set), "context": "clues"})
    evaluated = {
        sequence.pieces for sequence in question_sequences(Encoder(loaded), task, limit=LIMIT)
    }
    drawn = sampler.draw(random.Random(0), 0.0)
    assert len(drawn) == 30
    assert {sequence.pieces for sequence in drawn} <= evaluated
    by_question = {sample.question: sample for sample in task.samples}
    for sample in by_question.values():
        last = len(task.data.frames(sample.question.traj_id)) - 1
        shown = {"frames": (*sample.frames, last), "recalled": sample.frames}
        recalled = replace(sample, **shown)
        parts, text = CONTEXTS["memory"].request(task.data, recalled)
        assert text == CONTEXTS["clues"].request(task.data, sample)[1]
        assert len(parts) == len(recalled.frames)


def test_recorded_questions_are_asked_on_frames_that_answer_them(small_set, make, read):
    sampler = make(small_set, synthetic=0.0, recalled=1.0, recalled_frames=4, per_step=200)
    data = NiehSet(small_set)
    clues = defaultdict(list)  # by text and answer, which two trajectories may share
    for question in data.questions:
        own = [data.frames(question.traj_id)[at].digest for at in data.clue_positions(question)]
        evidence = set(own) if question.has_evidence else set()
        clues[f"{question.text}{doc_target(question)}"].append(evidence)
    lasts = {data.frames(question.traj_id)[-1].digest for question in data.questions}
    n_asked, n_frames = [], set()
    for sequence in sampler.draw(random.Random(0), 0.0):
        digests = {frame.digest for frame in sequence.frames}
        assert sequence.frames[-1].digest in lasts
        n_asked.append(len(sequence.branches))
        n_frames.add(len(digests))
        for span in sequence.spans[1:]:
            pieces = (*sequence.pieces[sequence.spans[0]], *sequence.pieces[span])
            text = read(pieces).removesuffix("<|im_end|>")
            known = max((known for known in clues if text.endswith(known)), key=len)
            assert any(evidence <= digests for evidence in clues[known])
    assert max(n_asked) > 1
    assert len(n_frames) > 2


@pytest.mark.parametrize("recalled", [0.0, 1.0])
def test_both_of_a_pair_are_asked_on_the_same_frames_by_number(recalled, twin_set, make, read):
    sampler = make(twin_set, per_step=8, synthetic=0.0, paired=1.0, recalled=recalled)
    data = NiehSet(twin_set)
    numbers = {
        name: [frame.digest for frame in data.frames(name)]
        for name in {question.traj_id for question in data.questions}
    }
    drawn = sampler.draw(random.Random(0), 0.0)
    for first, second in zip(drawn[::2], drawn[1::2], strict=True):
        both = zip(first.spans[1:], second.spans[1:], strict=True)
        for one, other in both:
            texts = [read(first.pieces[one]).split("?"), read(second.pieces[other]).split("?")]
            assert texts[0][0] == texts[1][0]
            assert texts[0][1] != texts[1][1]
        shown = [[frame.digest for frame in one.frames] for one in (first, second)]
        assert len(shown[0]) == len(shown[1])
        if not recalled:
            assert any(shown[0] == [own[at] for at in CLUES] for own in numbers.values())


def test_questions_on_whole_trajectories_are_branches_of_one_sequence_a_world(twin_set, make, read):
    sampler = make(twin_set, paired=1.0, whole=1.0, per_trajectory=2)
    first, second = sampler.draw(random.Random(0), 0.0)
    n_frames = len(NiehSet(twin_set).frames("kitchen-1-a"))
    for world in (first, second):
        assert len(world.frames) == n_frames
        assert len(world.branches) == 2
    texts = [[read(world.pieces[span]) for span in world.spans[1:]] for world in (first, second)]
    for one, other in zip(*texts, strict=True):
        assert one.split("?")[0] == other.split("?")[0]
        assert one != other


def test_the_curriculum_grows_from_nothing(small_set, make):
    settings = {"synthetic": 0.5, "synthetic_frames": 30, "recalled": 1.0, "ramp": 0.5}
    sampler = make(small_set, whole=1.0, recalled_frames=30, **settings)
    at_first = sampler.draw(random.Random(0), 0.0)
    assert len(at_first) > 1
    (later,) = sampler.draw(random.Random(0), 0.5)
    assert len(later.branches) > 12
    apart = make(small_set, recalled_frames=30, **settings)
    longest = [
        max(len(sequence.frames) for sequence in apart.draw(random.Random(0), progress))
        for progress in (0.0, 0.5)
    ]
    assert longest[1] > longest[0] + 15


@pytest.mark.parametrize("wrong", [{"per_step": 0}, {"whole": 1.5}, {"ramp": -0.1}])
def test_settings_out_of_range_are_refused(wrong):
    (name,) = wrong
    with pytest.raises(ValueError, match=name):
        QuestionSettings(**wrong)
