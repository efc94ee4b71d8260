"""Checkpoints that somebody damaged, or made up: one line, before any question, and no code of
theirs runs."""

import os
import pickle
import shutil
import threading

import pytest
import torch
from safetensors.torch import load_file, save_file

from infthor_eval.errors import ModelError
from model_adapters import load

from ..helpers.files import edit_json
from ..helpers.refusals import assert_raises_one_line
from ..model_adapters.checkpoints import save


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("checkpoint") / "whole"
    save("qwen2.5-vl", folder)
    return folder


def _generation(**changes):
    return edit_json("generation_config.json", **changes)


def _content(name, content):
    return lambda folder: (folder / name).write_bytes(content)


def _without(name):
    return lambda folder: (folder / name).unlink()


def _weights(change):
    def edit(folder):
        tensors = load_file(folder / "model.safetensors")
        save_file(change(tensors), folder / "model.safetensors", metadata={"format": "pt"})

    return edit


class _Evil:
    def __reduce__(self):
        return os.mkdir, ("evil",)


def _pickled(folder):
    (folder / "model.safetensors").unlink()
    (folder / "pytorch_model.bin").write_bytes(pickle.dumps(_Evil()))


def _legacy_pickle(folder):
    tensors = load_file(folder / "model.safetensors")
    (folder / "model.safetensors").unlink()
    torch.save(tensors, folder / "pytorch_model.bin")


def _template(text):
    return lambda folder: (folder / "chat_template.jinja").write_text(text)


def _pipe(folder):
    (folder / "model.safetensors").unlink()
    os.mkfifo(folder / "model.safetensors")


REFUSES, LOADED = "the chat template refuses", "cannot be loaded"
DEEP = b"[" * 200_000
CONTENTS = {
    "weights are text": ("model.safetensors", b"text"),
    "weights are empty": ("model.safetensors", b""),
    "config is empty": ("config.json", b""),
    "config is a list": ("config.json", b"[]"),
    "config is deep": ("config.json", DEEP),
    "config is no UTF-8": ("config.json", b'{"a": "\xff"}'),
    "config without a type": ("config.json", b"{}"),
    "tokenizer is empty": ("tokenizer.json", b""),
    "tokenizer is deep": ("tokenizer.json", DEEP),
    "tokenizer is of another form": ("tokenizer.json", b'{"version": "1.0", "model": 5}'),
    "image processor is a list": ("preprocessor_config.json", b"[]"),
    "template is no UTF-8": ("chat_template.jinja", b"\xff"),
}
CONFIGS = {
    "config with a text for a number": {"text_config": {"hidden_size": "many"}},
    "config with no layers": {"text_config": {"num_hidden_layers": -1}},
    "config with a list for a part": {"vision_config": [1]},
}
ENDLESS = "{% for i in range(99999) %}{% for j in range(99999) %}{% endfor %}{% endfor %}"
DOUBLES = (
    "{% set a = namespace(t='x') %}{% for i in range(40) %}{% set a.t = a.t ~ a.t %}{% endfor %}"
)
LIMIT = "set INFTHOR_EVAL_MAX_TEMPLATE_"
TEMPLATES = {
    "template is broken": ("{% for %}", REFUSES),
    "template divides by nothing": ("{{ 1 / 0 }}", REFUSES),
    "template takes what is not there": ("{{ messages[99].content.x }}", REFUSES),
    "template raises": ("{{ raise_exception('no') }}", REFUSES),
    "template reaches for Python": ("{{ ''.__class__.__mro__ }}", "the chat template"),
    "template counts to a milliard": ("{% for i in range(10**9) %}{% endfor %}", REFUSES),
    "template calls itself": ("{% macro m() %}{{ m() }}{% endmacro %}{{ m() }}", REFUSES),
    "template without end": (ENDLESS, f"{LIMIT}SECONDS to more than 1"),
    "template repeats a text": ("{{ 'x' * 10**10 }}", f"{LIMIT}MB to more than 512"),
    "template repeats a list": (
        "{{ (messages * 10**9) | length }}",
        f"{LIMIT}MB to more than 512",
    ),
    "template fills a line": ("{{ 'x' | center(10**10) }}", f"{LIMIT}MB to more than 512"),
    "template doubles a text": (DOUBLES, f"{LIMIT}MB to more than 512"),
    "template writes without end": (
        "{% for i in range(99999) %}{{ 'x' * 10**5 }}{% endfor %}",
        f"{LIMIT}MB to more than 512",
    ),
    "template makes a text of twenty million": (
        "{% for i in range(2000) %}{{ 'x' * 10**4 }}{% endfor %}",
        f"{LIMIT}CHARACTERS to more than 16000000",
    ),
}
DAMAGES = {
    **{name: (_content(*file), LOADED) for name, file in CONTENTS.items()},
    **{name: (edit_json("config.json", **changes), LOADED) for name, changes in CONFIGS.items()},
    **{name: (_template(text), expected) for name, (text, expected) in TEMPLATES.items()},
    "a pickle that runs code": (_pickled, LOADED),
    "a pickle": (_legacy_pickle, LOADED),
    "weights are a pipe": (_pipe, "is a pipe or a device, not a file"),
    "no weights": (_without("model.safetensors"), LOADED),
    "weights of another shape": (
        _weights(lambda weights: {name: tensor.new_zeros(3) for name, tensor in weights.items()}),
        LOADED,
    ),
    "weights that are missing": (
        _weights(lambda weights: dict(list(weights.items())[:3])),
        "lacks",
    ),
    "image processor with texts": (edit_json("preprocessor_config.json", patch_size="x"), ""),
    "image processor with no patch": (edit_json("preprocessor_config.json", patch_size=0), ""),
    "generation is a list": (_content("generation_config.json", b"[1]"), ""),
    "end is a text": (_generation(eos_token_id="end"), "eos_token_id is"),
    "end is a list of texts": (_generation(eos_token_id=["end"]), "eos_token_id is"),
    "end is a fraction": (_generation(eos_token_id=1.5), "eos_token_id is"),
    "penalty is a text": (_generation(repetition_penalty="x"), ""),
    "penalty is nothing": (_generation(repetition_penalty=0.0), "repetition_penalty"),
    "template of old is a list": (
        lambda folder: (
            _without("chat_template.jinja")(folder),
            _content("chat_template.json", b"[]")(folder),
        ),
        "",
    ),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_checkpoint(whole, tmp_path, monkeypatch, name):
    from PIL import Image

    from infthor_eval.formats.frames import FrameRef

    monkeypatch.chdir(tmp_path)
    if name == "template without end":  # the others end before the default, however busy it is here
        monkeypatch.setenv("INFTHOR_EVAL_MAX_TEMPLATE_SECONDS", "1")
    monkeypatch.setenv("INFTHOR_EVAL_MAX_TEMPLATE_MB", "512")
    folder = shutil.copytree(whole, tmp_path / "damaged")
    Image.new("RGB", (56, 56)).save(tmp_path / "a.png")
    damage, expected = DAMAGES[name]
    damage(folder)

    def ask():
        model = load("qwen2.5-vl", {"pretrained": str(folder), "device": "cpu"}, 0)
        conversation = model.conversation()
        conversation.append(FrameRef(tmp_path / "a.png"), "What is it?")
        return conversation.n_tokens

    assert_raises_one_line(ask, expected)
    assert not (tmp_path / "evil").exists()


def test_a_template_without_end_is_stopped_in_any_thread(whole, tmp_path, monkeypatch):
    monkeypatch.setenv("INFTHOR_EVAL_MAX_TEMPLATE_SECONDS", "1")
    folder = shutil.copytree(whole, tmp_path / "endless")
    failures = []

    def ask():
        try:
            model = load("qwen2.5-vl", {"pretrained": str(folder), "device": "cpu"}, 0)
            conversation = model.conversation()
            conversation.append("What is it?")
            print(conversation.n_tokens)
        except ModelError as error:
            failures.append(str(error))

    _template(ENDLESS)(folder)
    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    thread.join(60.0)
    assert not thread.is_alive()
    assert "it is not done after 1 s" in failures[0]
