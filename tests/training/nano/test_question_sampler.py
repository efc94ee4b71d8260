"""Which questions the small model is trained on, and which frames they show."""

import random
from collections import defaultdict

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.household.wording import noun
from infthor_eval.training.encoding import Encoder
from infthor_eval.training.nano.architecture import build_untrained, image_processor
from infthor_eval.training.nano.frame_dataset import read_frame_dataset
from infthor_eval.training.nano.question_sampler import QuestionSampler, question_intro
from infthor_eval.training.nano.sampler import corpus_texts
from infthor_eval.training.nano.settings import NanoRecipe, QuestionSettings

from ...helpers.twin_sets import CLUES, write_twin_set

RECIPE = NanoRecipe(title="small", hidden=32, layers=1, threads=1)
LIMIT = 2048


@pytest.fixture(scope="module")
def dataset(small_set):
    return read_frame_dataset([small_set], image_processor())


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


def test_synthetic_questions_are_true_and_their_names_do_not_give_away_the_answer(
    small_set, dataset, make, read
):
    sampler = make(small_set, per_step=200, synthetic=1.0)
    index, counts = dataset.index_by_digest(), {"yes": 0, "no": 0}
    words = {noun(name): at for at, name in enumerate(dataset.types)}
    for sequence in sampler.draw(random.Random(0), 0.0):
        (frame,) = sequence.frames
        text = read(sequence.pieces)
        answer = text.rpartition("?")[2].removesuffix("<|im_end|>")
        about = max((name for name in words if f" {name}" in text), key=len)
        counts[answer] += 1
        here = index[frame.digest]
        assert bool(dataset.visible[here, words[about]]) == (answer == "yes")
        assert answer == "yes" or not dataset.present[here, words[about]]
    assert min(counts.values()) > 70


def test_recalled_questions_have_their_clues_among_other_frames_and_end_with_the_last_view(
    small_set, make, read
):
    sampler = make(small_set, per_step=60, synthetic=0.0, recalled=1.0, recalled_frames=4)
    data = NiehSet(small_set)
    clues = defaultdict(list)  # by text, which questions on two trajectories may share
    for question in data.questions:
        clues[question.text].append({frame.digest for frame in data.clue_frames(question)})
    absences = {question.text for question in data.questions if question.absence}
    lasts = {data.frames(question.traj_id)[-1].digest for question in data.questions}
    n_others = set()
    for sequence in sampler.draw(random.Random(0), 0.0):
        digests = [frame.digest for frame in sequence.frames]
        text = read(sequence.pieces)
        question_text = max((known for known in clues if known in text), key=len)
        assert digests[-1] in lasts
        if question_text not in absences:
            own = next(frames for frames in clues[question_text] if frames <= set(digests))
            n_others.add(len(set(digests) - own - lasts))
    assert n_others <= set(range(5))
    assert len(n_others) > 2


@pytest.mark.parametrize("recalled", [0.0, 1.0])
def test_both_of_a_pair_are_asked_on_the_same_frames_by_number(recalled, twin_set, make, read):
    sampler = make(twin_set, per_step=8, synthetic=0.0, paired=1.0, recalled=recalled)
    data = NiehSet(twin_set)
    numbers = {
        name: [frame.digest for frame in data.frames(name)]
        for name in {question.traj_id for question in data.questions}
    }
    drawn = sampler.draw(random.Random(0), 0.0)
    assert len(drawn) == 8
    for first, second in zip(drawn[::2], drawn[1::2], strict=True):
        texts = [read(one.pieces).split("?") for one in (first, second)]
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
    settings = {"synthetic": 0.0, "recalled": 1.0, "recalled_frames": 30, "ramp": 0.5}
    sampler = make(small_set, per_step=30, whole=1.0, **settings)
    at_first = sampler.draw(random.Random(0), 0.0)
    assert len(at_first) == 30
    assert not any(sequence.branches for sequence in at_first)
    (later,) = sampler.draw(random.Random(0), 0.5)
    assert later.branches
    apart = make(small_set, per_step=30, **settings)
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
