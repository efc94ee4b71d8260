import shutil
from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image
from transformers import AutoImageProcessor, AutoTokenizer, CLIPModel

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.memory import Observation, Query, TrajectoryFacts, open_memory
from infthor_eval.nieh.asking.recalling import recall_all
from infthor_eval.nieh.contexts import CONTEXTS, ContextSettings
from infthor_eval.nieh.samples import find_samples
from infthor_eval.report.sample import Sample
from infthor_eval.run import Run
from model_adapters.hf.retrieval import open_retriever

TEXTS = ("Is there a mug?", "Where was the plate?", "What did you put on the table?")
QUESTIONS = [Question("t", text, (1,), ("yes",)) for text in TEXTS]


@pytest.fixture(scope="module")
def clip(make_clip):
    return make_clip()


@pytest.fixture
def noise(make_nieh_set):
    """A set of one trajectory whose frames are noise, each another."""

    def make(n_frames):
        root = make_nieh_set(QUESTIONS, n_frames=n_frames, size=8)
        draw = np.random.default_rng(0)
        for path in sorted((root / "metadata" / "t" / "img").iterdir()):
            Image.fromarray(draw.integers(0, 256, (8, 8, 3), dtype=np.uint8)).resize((40, 40)).save(
                path
            )
        return root

    return make


def frames_of(context, root, question=QUESTIONS[0], **settings):
    (sample,) = CONTEXTS[context].samples(NiehSet(root), question, ContextSettings(**settings))
    return sample if isinstance(sample, SkippedQuestion) else list(sample.frames)


def recalled(root, k, clip, question=QUESTIONS[0], memory="clip-view"):
    """The frames that a memory has shown."""
    config = {
        "context": "memory",
        "memory": memory,
        "memory_args": {"k": k},
        "retriever": str(clip),
    }
    task_samples = find_samples({**config, "data": str(root)})
    by_text = {sample.question.text: sample for sample in recall_all(task_samples)}
    return list(by_text[question.text].frames)


@torch.inference_mode()
def similarities(clip, root):
    """Cosines of (texts, frames) and (frames, frames), by transformers alone, all frames in one
    batch."""
    model = CLIPModel.from_pretrained(clip)
    images = [
        Image.open(path).convert("RGB")
        for path in sorted((root / "metadata" / "t" / "img").iterdir())
    ]
    pixels = AutoImageProcessor.from_pretrained(clip, backend="pil")(
        images=images, return_tensors="pt"
    )
    texts = AutoTokenizer.from_pretrained(clip)(list(TEXTS), padding=True, return_tensors="pt")
    outputs = model(**pixels, **texts)
    between = outputs.image_embeds @ outputs.image_embeds.T
    return (outputs.logits_per_text / model.logit_scale.exp()).numpy(), between.numpy()


def largest(row, k):
    ranked = sorted(range(len(row)), key=lambda position: -row[position])
    gap = row[ranked[k - 1]] - row[ranked[k]]
    assert gap > 1e-5, "a tie would make the expectation arbitrary"
    return sorted(ranked[:k])


def test_the_frames_nearest_to_each_question_are_those_of_plain_transformers(noise, clip):
    root = noise(40)
    to_texts, _ = similarities(clip, root)
    nearest = [
        frames_of("clip_retrieval", root, question, retriever=str(clip)) for question in QUESTIONS
    ]
    assert nearest == [largest(row, 10) for row in to_texts]
    assert len({tuple(frames) for frames in nearest}) == len(QUESTIONS)
    assert frames_of("clip_retrieval", root, retriever=str(clip), top_k=3) == largest(
        to_texts[0], 3
    )


def test_a_memory_recalls_those_nearest_to_the_question_or_to_the_last_view_which_comes_after_them(
    noise, clip
):
    root = noise(40)
    to_texts, between = similarities(clip, root)
    assert recalled(root, 10, clip, memory="clip") == [*largest(to_texts[0, :-1], 10), 39]
    assert recalled(root, 20, clip) == [*largest(between[-1, :-1], 20), 39]


def test_a_memory_may_be_asked_with_the_goal(noise, clip):
    root = noise(40)
    to_texts, _ = similarities(clip, root)
    memory = open_memory("clip", (("k", 5), ("query", "goal"), ("retriever", str(clip))))
    frames = NiehSet(root).frames("t")
    steps = [
        Observation(number=number, frame=frame, goal=TEXTS[2])
        for number, frame in enumerate(frames)
    ]
    memory.begin(TrajectoryFacts(name="t"))
    for step in steps[:-1]:
        memory.observe(step)
    recalled_steps = memory.recall(Query(text=TEXTS[0], present=steps[-1]), None)
    assert [step.number for step in recalled_steps] == largest(to_texts[2, :-1], 5)
    with pytest.raises(DataError, match="the goal at this step is not known; take query=question"):
        memory.recall(Query(text=TEXTS[0], present=replace(steps[-1], goal=None)), None)
    with pytest.raises(UsageError, match="the memory clip: query is 'view'"):
        open_memory("clip", (("query", "view"),))


def test_a_short_trajectory_is_shown_whole(noise, clip):
    root = noise(4)
    assert frames_of("clip_retrieval", root, retriever=str(clip)) == [0, 1, 2, 3]
    assert recalled(root, 10, clip) == [0, 1, 2, 3]
    assert recalled(root, 2, clip)[-1] == 3


def test_of_equal_frames_the_earlier_are_taken(noise, clip):
    root = noise(40)
    images = sorted((root / "metadata" / "t" / "img").iterdir())
    for path in images[1:]:
        shutil.copy(images[0], path)
    assert frames_of("clip_retrieval", root, retriever=str(clip), top_k=5) == [0, 1, 2, 3, 4]
    assert recalled(root, 3, clip) == [0, 1, 2, 39]


def test_each_frame_is_decoded_once_and_few_at_a_time(noise, make_clip, monkeypatch):
    root, clip = noise(70), make_clip(seed=3)
    loaded, load = [], FrameRef.load
    monkeypatch.setattr(
        FrameRef, "load", lambda frame: loaded.append(frame.path.name) or load(frame)
    )
    batches, features = [], CLIPModel.get_image_features

    def counted(model, **inputs):
        batches.append(len(inputs["pixel_values"]))
        return features(model, **inputs)

    monkeypatch.setattr(CLIPModel, "get_image_features", counted)
    for question in QUESTIONS:
        first = frames_of("clip_retrieval", root, question, retriever=str(clip))
        assert frames_of("clip_retrieval", root, question, retriever=str(clip)) == first
        recalled(root, 10, clip, question)
    assert loaded == [f"{index:09d}.png" for index in range(70)]
    assert batches == [32, 32, 6]
    open_retriever.cache_clear()  # as in the next process
    assert frames_of("clip_retrieval", root, question, retriever=str(clip)) == first
    assert len(loaded) == 70


def test_a_frame_that_cannot_be_decoded_has_the_question_skipped(noise, clip):
    root = noise(12)
    broken = root / "metadata" / "t" / "img" / "000000007.png"
    broken.write_bytes(broken.read_bytes()[:60])
    assert (
        f"{broken}: not a readable image"
        in frames_of("clip_retrieval", root, retriever=str(clip)).reason
    )
    with pytest.raises(UsageError, match=f"{broken}: not a readable image"):
        recalled(root, 10, clip)


def test_a_question_beyond_clips_limit_is_cut(noise, clip):
    question = Question("t", "Is there a mug on the table? " * 40, (1,), ("yes",))
    assert len(frames_of("clip_retrieval", noise(12), question, retriever=str(clip))) == 10


def test_the_identity_tells_weights_apart_and_not_places(noise, make_clip, clip, tmp_path):
    data = NiehSet(noise(4))

    def identity(folder):
        return CONTEXTS["clip_retrieval"].sources(data, ContextSettings(retriever=str(folder)))[
            "retriever"
        ]

    moved = tmp_path / "elsewhere" / clip.name
    shutil.copytree(clip, moved)
    assert identity(clip) == identity(moved)
    assert identity(clip)["fingerprint"] != identity(make_clip(seed=1))["fingerprint"]
    assert CONTEXTS["trajectory"].sources(data, ContextSettings()) == {}


def test_a_retriever_that_cannot_be_loaded_says_so(noise, clip, tmp_path):
    half = tmp_path / "half"
    shutil.copytree(clip, half)
    (half / "model.safetensors").write_bytes(b"no weights")
    with pytest.raises(UsageError, match="half cannot be loaded"):
        frames_of("clip_retrieval", noise(4), retriever=str(half))


def test_a_checkpoint_of_another_kind_is_refused(noise, tmp_path):
    from model_adapters.tiny.qwen2_5_vl import save_tiny_checkpoint

    save_tiny_checkpoint(tmp_path / "qwen", seed=0)
    with pytest.raises(UsageError, match="is a qwen2_5_vl checkpoint; retrieval needs one of CLIP"):
        frames_of("clip_retrieval", noise(4), retriever=str(tmp_path / "qwen"))


def test_which_frames_were_retrieved_is_known_without_model_and_set(noise, clip, tmp_path, run_cli):
    root = noise(14)
    shown = frames_of("clip_retrieval", root, retriever=str(clip))
    words = ("--model", "oracle", "--tasks", "nieh_clip_retrieval", "--retriever", clip)
    assert run_cli(*words, "--data", root, "--limit", "1", "--out", tmp_path / "out")[0] == 0
    shutil.rmtree(root)
    (folder,) = (tmp_path / "out").glob("*/*")
    run = Run.open(folder)
    (request,) = (Sample(run, record).request for record in run.records)
    places = [at for first, last in request.shown for at in range(first, last + 1)]
    assert len(places) == len(shown) == 10
    _, out, _ = run_cli("show", folder, "--question", run.records[0].id)
    assert f"\nQuestion: {run.records[0].payload.question}" in out
