"""What a checkpoint's card says of its training."""

import pytest

from infthor_eval.storage.folders import packaged_folder
from model_adapters.hf.loading.card import read_card_words
from model_adapters.hf.loading.checkpoint import origin

CARDS = {
    "---\ninfthor_words: natural\n---\n# A model\n": "natural",
    "---\nlicense: mit\ninfthor_words: published\n---\n": "published",
    "---\nlicense: mit\n---\n# A model\n": None,
    "# A model\ninfthor_words: natural\n": None,
    "---\ninfthor_words: natural\n": None,  # the metadata has no end
    "---\ninfthor_words: [natural\n---\n": None,
    "---\ninfthor_words: 5\n---\n": None,
    "---\n- infthor_words\n---\n": None,
    "": None,
}


@pytest.mark.parametrize("text", CARDS)
def test_the_words_stand_in_the_metadata(tmp_path, text):
    (tmp_path / "README.md").write_text(text)
    assert read_card_words(tmp_path) == CARDS[text]


def test_a_checkpoint_need_not_have_a_card(tmp_path):
    assert read_card_words(tmp_path) is None
    assert "trained_words" not in origin(tmp_path, None, "x")


def test_the_words_are_part_of_the_identity(tmp_path):
    (tmp_path / "README.md").write_text("---\ninfthor_words: natural\n---\n")
    for commit in (None, "abc"):
        assert origin(tmp_path, commit, "x")["trained_words"] == "natural"


def test_the_bundled_model_was_trained_on_published_words():
    assert read_card_words(packaged_folder("models/qwen2.5-vl-nano")) == "published"
