"""Models that cannot be run, or that fail during a run: one line each, and the exit code."""

import shutil

import pytest
import torch
from transformers import LlamaConfig

from infthor_eval.formats.question import Question
from model_adapters.tiny.qwen2_5_vl import Qwen25VLTiny

from ...conftest import QUESTIONS
from ...helpers.command_line import option_words
from ...helpers.files import edit_json
from ...helpers.journals import read_records
from ...model_adapters.checkpoints import save

QWEN, LLAVA = "qwen2.5-vl", "hf-vlm"


@pytest.fixture(scope="module")
def checkpoints(tmp_path_factory):
    root = tmp_path_factory.mktemp("checkpoints")
    save("qwen2.5-vl", root / QWEN)
    save("llava", root / LLAVA)
    return root


@pytest.fixture
def ask(make_nieh_set, tmp_path, run_cli):
    """Runs `nieh_gt` with the checkpoint in a folder."""
    data = make_nieh_set(size=56)

    def ask(model, folder, *options, **model_args):
        settings = ",".join(
            f"{key}={value}"
            for key, value in {"pretrained": folder, "device": "cpu", **model_args}.items()
        )
        arguments = option_words(model=model, model_args=settings, tasks="nieh_gt", data=data)
        return run_cli(*arguments, "--out", tmp_path / "out", *options)

    return ask


def _text_only(folder):
    LlamaConfig(vocab_size=10).save_pretrained(folder)


def _without_slot(folder):
    template = folder / "chat_template.jinja"
    template.write_text(template.read_text().replace("<|image_pad|>", "").replace("<image>", ""))


_other_size = edit_json("processor_config.json", patch_size=28)
BROKEN = {
    "text only": (LLAVA, _text_only, "is a llama checkpoint, which has no vision"),
    "text only, by a family": (QWEN, _text_only, "is a llama checkpoint, not qwen2_5_vl"),
    "merged patches": (
        QWEN,
        edit_json("preprocessor_config.json", merge_size=4),
        "the processor makes 25 image tokens of one frame and the model 100 features; they do not "
        "belong",
    ),
    "patches": (
        QWEN,
        edit_json("preprocessor_config.json", patch_size=20),
        "the model fails on what the processor makes of a frame",
    ),
    "number of tokens": (LLAVA, _other_size, "do they belong to one checkpoint?"),
    "number of tokens, without sharing": (
        LLAVA,
        _other_size,
        "the model fails on what the processor makes of a frame (Image features and image tokens "
        "do not match",
        {"share_prefix": "false"},
    ),
    "image token": (QWEN, edit_json("config.json", image_token_id=7), "0 image placeholders for"),
    "template without a slot": (QWEN, _without_slot, "the template must show every frame"),
    "template without a slot, hf-vlm": (LLAVA, _without_slot, "the template must show every frame"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_checkpoint_that_cannot_work_is_one_line_before_any_question(
    checkpoints, tmp_path, ask, name
):
    model, damage, expected, *options = BROKEN[name]
    folder = shutil.copytree(checkpoints / model, tmp_path / "checkpoint")
    damage(folder)
    code, out, err = ask(model, folder, **dict(*options))
    (line,) = [line for line in err.splitlines() if line.startswith("infthor-eval: ")]
    assert expected in line
    assert (code, out) == (2, "")
    assert "Traceback" not in err
    assert not list(tmp_path.rglob("worker-*.jsonl"))


def test_a_context_beyond_the_limit_is_recorded_with_its_tokens_and_the_limit(
    make_nieh_set, tmp_path, run_cli
):
    data = make_nieh_set()
    arguments = option_words(
        model="qwen2.5-vl-tiny", model_args="max_tokens=600", tasks="nieh", data=data
    )
    code, _, err = run_cli(*arguments, "--out", tmp_path / "out")
    records = read_records(tmp_path / "out")
    failed = [record for record in records if record.failure]
    # Six frames of 123 tokens; of the clues, three at most.
    assert {record.task for record in failed} == {"nieh_full"}
    assert len(failed) == 5
    assert all(
        "and 50 new ones is beyond the 600 tokens of qwen2.5-vl-tiny" in record.failure
        for record in failed
    )
    assert all(int(record.failure.split()[3]) > 6 * 123 for record in failed)
    assert code == 1
    assert "Traceback" not in err


def test_a_question_with_the_models_image_token_fails_alone(make_nieh_set, tmp_path, run_cli):
    bad = Question("traj_b", "What is <|image_pad|>?", (3,), ("mug",))
    data = make_nieh_set([*QUESTIONS, bad], size=56)
    arguments = option_words(
        model="qwen2.5-vl-tiny", tasks="nieh_gt", data=data, out=tmp_path / "out"
    )
    assert run_cli(*arguments)[0] == 1
    (failed,) = [record for record in read_records(tmp_path / "out") if record.failure]
    assert failed.payload.question == bad.text
    assert "2 image placeholders for 1 frames" in failed.failure


class Cramped(Qwen25VLTiny):
    """A tiny model on a device with memory for so many tokens, registered as another package
    would."""

    ROOM = 500

    @classmethod
    def build(cls, name, options, seed):
        model = super().build(name, options, seed)
        text_model = model._loaded.model.get_decoder()

        def allocate(_, args, kwargs):
            if (
                kwargs["past_key_values"].get_seq_length() + kwargs["inputs_embeds"].shape[1]
                > cls.ROOM
            ):
                raise torch.OutOfMemoryError("CUDA out of memory. Tried to allocate 2.00 GiB.")

        text_model.register_forward_pre_hook(allocate, with_kwargs=True)
        return model


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Installs a package that brings a model: name and "module:Class"."""

    def install(name, target):
        info = tmp_path / "site" / "brought-1.0.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: brought\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[infthor_eval.models]\n{name} = {target}\n")
        monkeypatch.syspath_prepend(tmp_path / "site")

    return install


@pytest.mark.parametrize("batch_size", [1, 3])
def test_out_of_memory_in_mid_run_costs_the_contexts_that_are_too_large(
    make_nieh_set, tmp_path, run_cli, install, batch_size
):
    install("cramped", f"{__name__}:Cramped")
    long = Question("traj_a", "What did you see?", (0, 1, 2, 3, 4), ("mug",))
    data = make_nieh_set([QUESTIONS[0], long, *QUESTIONS[3:]])
    arguments = option_words(
        model="cramped", model_args=f"batch_size={batch_size}", tasks="nieh", data=data
    )
    code, out, err = run_cli(*arguments, "--out", tmp_path / "out")
    assert code == 1
    assert "Traceback" not in err
    records = read_records(tmp_path / "out")
    failed = [record for record in records if record.failure]
    assert {(record.task, record.payload.n_clues) for record in failed} == {
        ("nieh_gt", 5),
        *(("nieh_full", n) for n in (1, 5)),
    }
    assert [record.payload.reply is not None for record in records if record not in failed] == [
        True
    ] * 3
    for record in failed:
        n_frames = 5 if record.task == "nieh_gt" else 6
        assert (
            int(record.failure.removeprefix("out of memory on a context of ").split()[0])
            > n_frames * 123
        )
        assert record.failure.endswith(
            "(cramped); use fewer frames, kv_offload=true, or a smaller chunk_tokens"
        )
    assert "nieh_full: " in err
    assert any(
        line.split()[:3] == ["cramped", "(incomplete)", "nieh_gt"] and line.split()[-1] == "1"
        for line in out.splitlines()
    )
