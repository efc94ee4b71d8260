"""Nothing of transformers' progress bars and warnings reaches the terminal."""

import pytest
from transformers.utils import logging

from infthor_eval.errors import ModelError
from infthor_eval.formats.object_ids import Words
from infthor_eval.training.export import export
from model_adapters import load
from model_adapters.hf.loading.checkpoint import wrap_loading_errors
from model_adapters.hf.retrieval import Retriever

from ...asking import up_to

LOADED = [
    ("qwen2.5-vl-nano", None, {}),
    ("qwen2.5-vl", "qwen2.5-vl", {}),
    ("llava-onevision", "llava-onevision", {}),
    ("pixtral", "pixtral", {"prompt": "plain"}),
    ("deepseek-vl", "deepseek-vl", {}),
    ("hf-vlm", "llava", {}),
    ("hf-vlm", "gemma3", {"share_prefix": "false"}),
]


@pytest.fixture(autouse=True)
def verbose():
    """The defaults of transformers, whatever other tests have left."""
    verbosity, has_bars = logging.get_verbosity(), logging.is_progress_bar_enabled()
    logging.set_verbosity_warning()
    logging.enable_progress_bar()
    yield
    logging.set_verbosity(verbosity)
    if not has_bars:
        logging.disable_progress_bar()


@pytest.mark.parametrize(("name", "checkpoint", "options"), LOADED)
def test_a_model_is_loaded_asked_and_exported_in_silence(
    name, checkpoint, options, checkpoints, frames, tmp_path, capfd
):
    settings = {"device": "cpu", **options} | (
        {"pretrained": str(checkpoints[checkpoint])} if checkpoint else {}
    )
    capfd.readouterr()
    model = load(name, settings, seed=0)
    talk = model.conversation()
    talk.append(frames[0], "\nWhat is it?")
    talk.reply(up_to(2))
    export(model.loaded, tmp_path / "exported", title="a twin", words=Words.PUBLISHED)
    assert capfd.readouterr() == ("", "")


def test_a_clip_model_is_loaded_and_asked_in_silence(make_clip, frames, capfd):
    folder = make_clip()
    capfd.readouterr()
    retriever = Retriever(str(folder))
    retriever.frames(frames)
    retriever.text("Is there a mug?")
    assert capfd.readouterr() == ("", "")


def test_errors_are_kept_and_the_settings_of_transformers_restored():
    with (
        pytest.raises(ModelError, match=r"the checkpoint x cannot be loaded \(broken\)"),
        wrap_loading_errors("x"),
    ):
        assert not logging.is_progress_bar_enabled()
        assert logging.get_verbosity() == logging.ERROR
        raise ValueError("broken")
    assert logging.is_progress_bar_enabled()
    assert logging.get_verbosity() == logging.WARNING
