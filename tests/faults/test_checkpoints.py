"""Checkpoints that somebody damaged, or made up: one line, before any question, and no code of
theirs runs."""

import json
import os
import pickle
import shutil
import threading

import pytest
import torch
from safetensors.torch import load_file, save_file

from infthor_eval.errors import ModelError
from model_adapters import load

from ..helpers.refusals import assert_raises_one_line
from ..model_adapters.checkpoints import save


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("checkpoint") / "whole"
    save("qwen2.5-vl", folder)
    return folder


def _edit(name, **changes):
    def edit(folder):
        path = folder / name
        path.write_text(json.dumps(json.loads(path.read_text()) | changes))

    return edit


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


REFUSES = "the chat template refuses"
DEEP = b"[" * 200_000
DAMAGES = {
    "a pickle that runs code": (_pickled, "cannot be loaded"),
    "a pickle": (_legacy_pickle, "cannot be loaded"),
    "weights are a pipe": (_pipe, "is a pipe or a device, not a file"),
    "no weights": (_without("model.safetensors"), "cannot be loaded"),
    "weights are text": (_content("model.safetensors", b"text"), "cannot be loaded"),
    "weights are empty": (_content("model.safetensors", b""), "cannot be loaded"),
    "weights of another shape": (
        _weights(lambda weights: {name: tensor.new_zeros(3) for name, tensor in weights.items()}),
        "cannot be loaded",
    ),
    "weights that are missing": (
        _weights(lambda weights: dict(list(weights.items())[:3])),
        "lacks",
    ),
    "config is empty": (_content("config.json", b""), "cannot be loaded"),
    "config is a list": (_content("config.json", b"[]"), "cannot be loaded"),
    "config is deep": (_content("config.json", DEEP), "cannot be loaded"),
    "config is no UTF-8": (_content("config.json", b'{"a": "\xff"}'), "cannot be loaded"),
    "config without a type": (_content("config.json", b"{}"), "cannot be loaded"),
    "config with a text for a number": (
        _edit("config.json", text_config={"hidden_size": "many"}),
        "cannot be loaded",
    ),
    "config with no layers": (
        _edit("config.json", text_config={"num_hidden_layers": -1}),
        "cannot be loaded",
    ),
    "config with a list for a part": (_edit("config.json", vision_config=[1]), "cannot be loaded"),
    "tokenizer is empty": (_content("tokenizer.json", b""), "cannot be loaded"),
    "tokenizer is deep": (_content("tokenizer.json", DEEP), "cannot be loaded"),
    "tokenizer is of another form": (
        _content("tokenizer.json", b'{"version": "1.0", "model": 5}'),
        "cannot be loaded",
    ),
    "image processor is a list": (_content("preprocessor_config.json", b"[]"), "cannot be loaded"),
    "image processor with texts": (_edit("preprocessor_config.json", patch_size="x"), ""),
    "image processor with no patch": (_edit("preprocessor_config.json", patch_size=0), ""),
    "generation is a list": (_content("generation_config.json", b"[1]"), ""),
    "end is a text": (_edit("generation_config.json", eos_token_id="end"), "eos_token_id is"),
    "end is a list of texts": (
        _edit("generation_config.json", eos_token_id=["end"]),
        "eos_token_id is",
    ),
    "end is a fraction": (_edit("generation_config.json", eos_token_id=1.5), "eos_token_id is"),
    "penalty is a text": (_edit("generation_config.json", repetition_penalty="x"), ""),
    "penalty is nothing": (
        _edit("generation_config.json", repetition_penalty=0.0),
        "repetition_penalty",
    ),
    "template is broken": (_template("{% for %}"), REFUSES),
    "template divides by nothing": (_template("{{ 1 / 0 }}"), REFUSES),
    "template takes what is not there": (_template("{{ messages[99].content.x }}"), REFUSES),
    "template raises": (_template("{{ raise_exception('no') }}"), REFUSES),
    "template reaches for Python": (_template("{{ ''.__class__.__mro__ }}"), "the chat template"),
    "template counts to a milliard": (
        _template("{% for i in range(10**9) %}{% endfor %}"),
        REFUSES,
    ),
    "template calls itself": (
        _template("{% macro m() %}{{ m() }}{% endmacro %}{{ m() }}"),
        REFUSES,
    ),
    "template without end": (
        _template("{% for i in range(99999) %}{% for j in range(99999) %}{% endfor %}{% endfor %}"),
        "set INFTHOR_EVAL_MAX_TEMPLATE_SECONDS to more than 1",
    ),
    "template repeats a text": (
        _template("{{ 'x' * 10**10 }}"),
        "set INFTHOR_EVAL_MAX_TEMPLATE_MB to more than 512",
    ),
    "template repeats a list": (
        _template("{{ (messages * 10**9) | length }}"),
        "set INFTHOR_EVAL_MAX_TEMPLATE_MB to more than 512",
    ),
    "template fills a line": (
        _template("{{ 'x' | center(10**10) }}"),
        "set INFTHOR_EVAL_MAX_TEMPLATE_MB to more than 512",
    ),
    "template doubles a text": (
        _template(
            "{% set a = namespace(t='x') %}{% for i in range(40) %}{% set a.t = a.t ~ a.t %}{% "
            "endfor %}"
        ),
        "set INFTHOR_EVAL_MAX_TEMPLATE_MB to more than 512",
    ),
    "template writes without end": (
        _template("{% for i in range(99999) %}{{ 'x' * 10**5 }}{% endfor %}"),
        "set INFTHOR_EVAL_MAX_TEMPLATE_MB to more than 512",
    ),
    "template makes a text of twenty million": (
        _template("{% for i in range(2000) %}{{ 'x' * 10**4 }}{% endfor %}"),
        "set INFTHOR_EVAL_MAX_TEMPLATE_CHARACTERS to more than 16000000",
    ),
    "template is no UTF-8": (_content("chat_template.jinja", b"\xff"), "cannot be loaded"),
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
    loops = "{% for i in range(99999) %}{% for j in range(99999) %}{% endfor %}{% endfor %}"
    failures = []

    def ask():
        try:
            model = load("qwen2.5-vl", {"pretrained": str(folder), "device": "cpu"}, 0)
            conversation = model.conversation()
            conversation.append("What is it?")
            print(conversation.n_tokens)
        except ModelError as error:
            failures.append(str(error))

    _template(loops)(folder)
    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    thread.join(60.0)
    assert not thread.is_alive()
    assert "it is not done after 1 s" in failures[0]
