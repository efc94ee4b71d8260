"""The small model that comes with the package."""

import pytest

from infthor_eval import evaluate
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.samples import find_samples
from infthor_eval.storage.folders import packaged_folder
from model_adapters import Decoding, check_adapter, load
from model_adapters.hf.families.qwen2_5_vl import NANO_FOLDER


@pytest.fixture(scope="module")
def nano():
    return load("qwen2.5-vl-nano", {}, seed=0)


def test_it_keeps_the_contract(nano):
    check_adapter(nano)


def test_it_is_small_and_has_a_card():
    folder = packaged_folder(NANO_FOLDER)
    assert sum(path.stat().st_size for path in folder.iterdir()) < 25e6
    assert "cannot" in (folder / "README.md").read_text()


def test_it_sees(nano):
    """More presence questions of the bundled set are answered rightly than by chance."""
    samples = find_samples({"bundled": "nieh_mini", "context": "clues"})
    presence_samples = [
        item for item in samples.samples if item.question.question_type == "object_presence"
    ]
    right = []
    for sample in presence_samples:
        talk = nano.conversation()
        context, text = samples.request(sample)
        talk.append(*context, text)
        right.append(talk.reply(Decoding(max_new_tokens=10)).text == doc_target(sample.question))
    assert sum(right) / len(right) > 0.6


def test_it_tells_worlds_apart_by_what_it_sees(tmp_path):
    """It has pairs of twins right on their clue frames, and on blank frames none."""
    runs = evaluate(
        model="qwen2.5-vl-nano",
        tasks="nieh_mini_twins",
        frames="shown,blank",
        limit=160,
        out=tmp_path,
    )
    shown, blank = runs.score
    assert shown > 0.05
    assert blank == 0
