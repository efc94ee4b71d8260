"""Questions at a moment: no frame and no text of later is in any request.

What comes after the moment is planted with pictures of one colour and a word of its own.
"""

import json
import re
import shutil
from dataclasses import replace

import pytest
from PIL import Image

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.pictures.video import Video
from infthor_eval.formats.qa_csv import read_questions, write_questions
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.nieh.asking.recalling import recall_all
from infthor_eval.nieh.contexts import CONTEXTS
from infthor_eval.nieh.docs import doc_of, sample_of
from infthor_eval.nieh.samples import find_samples
from infthor_eval.nieh.units import NiehUnit

from ...helpers.bundled import BUNDLED, bundled_name

MOMENT = 80
PLANTED = (255, 0, 254)
WORD = "Planted"
REASONS = ("the window reaches outside", "no state is told before")
WITHOUT_MODEL = sorted(CONTEXTS.keys() - {"clip_retrieval", "video"})


@pytest.fixture(scope="module")
def planted(tmp_path_factory):
    """A set of two homes, in which all that is after the moment is planted."""
    root = tmp_path_factory.mktemp("moments")
    names = [bundled_name("kitchen-1"), bundled_name("kitchen-2")]
    for name in names:
        plant(shutil.copytree(BUNDLED / "metadata" / name, root / "metadata" / name))
    questions = [
        Question(names[0], "Where is the knife now?", (39,), ("countertop",), moment=MOMENT),
        Question(names[0], "Is there any pan in this room?", (5, 30), ("yes",), moment=40),
        Question(names[1], "Is there any pan in this room?", (5,), ("yes",), moment=MOMENT),
    ]
    write_questions(root / "qa_set.csv", questions)
    return root


def plant(folder):
    for path in (folder / "img").iterdir():
        if int(path.stem) > MOMENT:
            Image.new("RGB", (300, 300), PLANTED).save(path)
    steps = json.loads((folder / "metadata.json").read_text())
    for step in steps[MOMENT + 1 :]:
        step["action"] = WORD
    (folder / "metadata.json").write_text(json.dumps(steps))
    trajectory = json.loads((folder / "traj_data.json").read_text())
    for action in trajectory["plan"]["low_actions"][MOMENT:]:
        action["api_action"]["action"] = WORD
    (folder / "traj_data.json").write_text(json.dumps(trajectory))
    states = json.loads((folder / "state_summary.json").read_text())
    states = {key: WORD if int(key) >= MOMENT else text for key, text in states.items()}
    (folder / "state_summary.json").write_text(json.dumps(states))
    texts = (folder / "traj.txt").read_text().split("<image>")
    shown = 0
    for number, text in enumerate(texts):
        texts[number] = text if shown <= MOMENT else re.sub(r">[^<]+<", f">{WORD}<", text)
        shown += text.rstrip().endswith("<|act|>")
    (folder / "traj.txt").write_text("<image>".join(texts))


def shown_in(task_samples, sample):
    """Numbers of the frames of a request, and its texts; no frame is planted."""
    parts, text = task_samples.request(sample)
    frames = [
        frame
        for part in parts
        if not isinstance(part, str)
        for frame in (part.frames if isinstance(part, Video) else [part])
    ]
    assert all(frame.load().getpixel((150, 150)) != PLANTED for frame in frames)
    texts = [text, *(part for part in parts if isinstance(part, str))]
    return frames, " ".join(texts)


@pytest.mark.parametrize("context", WITHOUT_MODEL)
@pytest.mark.parametrize("frames", ["shown", "blank", "shuffled", "other", "no-clue"])
def test_no_context_shows_what_is_after_the_moment(context, frames, planted):
    settings = {"ctx_size": 4, "tokens_per_frame": 121, "frames": frames, "memory": "uniform"}
    found = find_samples({"context": context, "data": str(planted), **settings})
    found = replace(found, samples=recall_all(found))
    assert not [it for it in found.skipped if not it.reason.startswith(REASONS)]
    for sample in found.samples:
        shown, texts = shown_in(found, sample)
        assert shown and WORD not in texts
        assert max(found.positions(sample)) <= sample.question.moment


@pytest.mark.parametrize("context", ["interleaved", "interleaved_plans", "text_state"])
def test_what_was_planted_is_in_the_texts_of_the_end(context, planted, tmp_path):
    root = shutil.copytree(planted, tmp_path / "set")
    question = replace(NiehSet(planted).questions[0], moment=None)
    write_questions(root / "qa_set.csv", [question])
    found = find_samples({"context": context, "data": str(root)})
    parts, _ = found.request(found.samples[0])
    assert any(isinstance(part, str) and WORD in part for part in parts)
    assert parts[-1].load().getpixel((150, 150)) == PLANTED


@pytest.mark.parametrize("has_film", [False, True])
def test_a_film_ends_at_the_moment(has_film, planted, tmp_path):
    root = shutil.copytree(planted, tmp_path / "set")
    if has_film:
        make_film(root / "metadata" / bundled_name("kitchen-1"))
    found = find_samples({"context": "video", "data": str(root), "fps": 2.0})
    assert len(found.samples) == 3
    for sample in found.samples:
        shown, _ = shown_in(found, sample)
        places = list(found.positions(sample))
        assert len(places) == len(shown) and 0.8 * sample.question.moment < max(places)
        assert max(places) <= sample.question.moment


def make_film(folder):
    import cv2

    path = folder / f"{folder.name}_10fps.mp4"
    film = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), 10, (300, 300))
    for file in sorted((folder / "img").iterdir()):
        film.write(cv2.imread(str(file)))
    film.release()


def test_a_memory_observes_once_and_is_asked_on_the_way(planted, tmp_path):
    (tmp_path / "spy.py").write_text(SPY)
    memory = f"{tmp_path}/spy.py:Spy"
    found = find_samples({"context": "memory", "data": str(planted), "memory": memory})
    recalls = [sample.recalled for sample in recall_all(found)]
    first, earlier, other = (json.loads(recalled[0]) for recalled in recalls)
    assert earlier == ["begin", *range(40), "present 40"]
    assert first == [*earlier, *range(40, MOMENT), f"present {MOMENT}"]
    assert other == [*first, "begin", *range(MOMENT), f"present {MOMENT}"]


SPY = f'''
import json
from infthor_eval.memory import MemoryCapabilities

class Spy:
    capabilities = MemoryCapabilities(privileged=True)
    seen = []

    def identity(self):
        return {{}}

    def begin(self, facts):
        self.seen.append("begin")

    def observe(self, observation):
        assert observation.action != "{WORD}"
        self.seen.append(observation.number)

    def recall(self, query, budget):
        self.seen.append(f"present {{query.present.number}}")
        return [json.dumps(self.seen)]
'''


def test_evidence_is_counted_up_to_the_moment(planted):
    found = find_samples({"context": "trajectory", "data": str(planted)})
    unit = NiehUnit.of("t", found, found.samples[0])
    assert unit.payload.shown_clues.n_after == MOMENT - 39


def test_the_moment_is_part_of_what_is_asked_and_kept_by_files_and_docs(planted, tmp_path):
    questions = NiehSet(planted).questions
    write_questions(tmp_path / "qa.csv", questions)
    assert read_questions(tmp_path / "qa.csv") == list(questions)
    first = questions[0]
    assert len({first.id, replace(first, moment=None).id, replace(first, moment=90).id}) == 3
    found = find_samples({"data": str(planted)})
    assert sample_of(doc_of(found, found.samples[0])).question == first


def test_moments_that_no_frame_has_or_that_are_before_a_clue_are_not_asked(planted, tmp_path):
    root = shutil.copytree(planted, tmp_path / "set")
    (first, *_) = NiehSet(planted).questions
    write_questions(root / "qa_set.csv", [replace(first, moment=m) for m in (38, 39, 5000)])
    rows = NiehSet(root).rows
    assert [isinstance(row, SkippedQuestion) for row in rows] == [True, False, True]
    assert rows[0].reason == "clue 39 is after the question's moment 38"
    assert rows[2].reason.startswith("moment 5000 is outside trajectory kitchen-1")
    text = (root / "qa_set.csv").read_text().replace("5000", "soon")
    (root / "qa_set.csv").write_text(text)
    assert "moment is not the number of a frame" in NiehSet(root).rows[2].reason
