"""A model on the double: the same words, the same counts as in transformers, and what its cache
finds."""

import json
import os
import shutil
import sys
from functools import partial
from types import SimpleNamespace

import pytest

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.formats.frames import FrameRef
from model_adapters import Decoding, check_adapter, load
from model_adapters.vllm.engine import import_vllm

from ..asking import load_saved, load_with, talk_of, up_to, user
from .families import FAMILIES, TEXTS, adapter_of, facts


@pytest.mark.parametrize("family", ["qwen2.5-vl", "pixtral", "llava"])
def test_it_keeps_the_contract(family, start):
    model = start(family, adapter_of(family))
    check_adapter(model, (84, 84))
    model.close()


@pytest.mark.parametrize("family", FAMILIES)
def test_replies_and_counts_are_those_of_transformers(family, start, in_process, frames):
    ours, theirs = start(family, adapter_of(family)), in_process(family, adapter_of(family))
    assert ours.tokens_per_frame(frames[0]) == theirs.tokens_per_frame(frames[0])
    prompts = [
        ("What do you see?",),
        (frames[0], "\nWhat is it?"),
        ("First ", frames[1], " then ", frames[2], "?"),
    ]
    for parts in prompts:
        talks = [model.conversation() for model in (ours, theirs)]
        for talk in talks:
            talk.append(*parts)
        assert talks[0].n_tokens == talks[1].n_tokens
        replies = [talk.reply(up_to(8)) for talk in talks]
        assert facts(replies[0]) == facts(replies[1])
        assert replies[0].n_context_tokens == talks[0].n_tokens
        assert replies[0].context_hash == replies[1].context_hash


@pytest.mark.parametrize("options", [{}, {"rope": "yarn:2"}])
def test_language_models_read_texts_alone(options, vllm, language_models, frames):
    ours = load_with("hf-lm@vllm", pretrained=language_models / "llama", dtype="float32", **options)
    theirs = load_saved("hf-lm", language_models / "llama", **options)
    for text in TEXTS:
        replies = [model.answer(user(text), up_to(8)) for model in (ours, theirs)]
        assert facts(replies[0]) == facts(replies[1])
    assert not ours.capabilities.image_input
    assert not {"limit_mm_per_prompt", "mm_processor_kwargs"} & set(vllm.started[0])
    with pytest.raises(ModelError, match="hf-lm@vllm reads text alone"):
        talk_of(ours, user(frames[0])).reply(up_to(2))


@pytest.mark.parametrize(
    "options", [{"prompt": "plain"}, {"rope": "yarn:4"}, {"max_pixels": 3_200}]
)
def test_options_that_change_what_is_read_change_it_alike(options, start, in_process, frames):
    ours, theirs = start(**options), in_process("qwen2.5-vl", **options)
    turns = user(frames[0], "Where is the mug? " * 8, frames[1])
    if "max_pixels" in options:  # the double's processor is the checkpoint's own: counts alone tell
        assert ours.count(turns) == theirs.count(turns) < in_process("qwen2.5-vl").count(turns)
        return
    assert facts(ours.answer(turns, up_to(8))) == facts(theirs.answer(turns, up_to(8)))
    assert ours.capabilities.max_tokens == theirs.capabilities.max_tokens
    assert (
        ours.capabilities.max_tokens_before_extension
        == theirs.capabilities.max_tokens_before_extension
    )


@pytest.mark.parametrize("rope", ["linear:2", "yarn:2"])
def test_a_model_of_one_axis_is_extended_alike(rope, start, in_process, vllm, frames):
    ours, theirs, turns = (
        start("pixtral", rope=rope),
        in_process("pixtral", rope=rope),
        user(frames[0], "Where?" * 20),
    )
    assert (
        vllm.started[0]["hf_overrides"]["text_config"]["rope_parameters"]["rope_type"]
        == rope.partition(":")[0]
    )
    extended = theirs.answer(turns, up_to(12))
    assert (
        facts(ours.answer(turns, up_to(12)))
        == facts(extended)
        != facts(in_process("pixtral").answer(turns, up_to(12)))
    )


def test_a_checkpoint_with_a_penalty_is_written_with_it(
    start, in_process, vllm, checkpoints, tmp_path
):
    folder = tmp_path / "penalised"
    shutil.copytree(checkpoints["qwen2.5-vl"], folder)
    settings = json.loads((folder / "generation_config.json").read_text())
    (folder / "generation_config.json").write_text(
        json.dumps(settings | {"repetition_penalty": 20.0})
    )
    turns, decoding = user("Where is the mug?"), up_to(40)
    ours, theirs = (
        make(pretrained=folder).answer(turns, decoding)
        for make in (start, partial(in_process, "qwen2.5-vl"))
    )
    assert facts(ours) == facts(theirs) != facts(in_process("qwen2.5-vl").answer(turns, decoding))
    assert vllm.calls[-1].params.repetition_penalty == 20.0
    start(pretrained=folder).answer(turns, up_to(40, repetition_penalty=1.0))
    assert vllm.calls[-1].params.repetition_penalty == 1.0


def test_a_stop_string_ends_and_cuts_the_reply_where_transformers_does(start, in_process, frames):
    ours, theirs, turns = start(), in_process("qwen2.5-vl"), user(frames[0], "Where?")
    whole = theirs.answer(turns, up_to(12)).text
    for stop in (whole[3:5], whole[-1], "never"):
        replies = [
            model.answer(turns, up_to(12, stop=("not this", stop))) for model in (ours, theirs)
        ]
        assert facts(replies[0]) == facts(replies[1])


SPECIAL = "<|im_start|>"


@pytest.mark.parametrize(
    ("message", "stop", "text"),
    [
        (f"mug on{SPECIAL}table", (SPECIAL,), "mug on"),
        (f"mug on{SPECIAL}table", ("never", "ta"), "mug on"),
        (f"mug{SPECIAL} on<|im_end|>table", (), "mug on"),
        (f"mug{SPECIAL} on<|endoftext|>table", ("table",), "mug on"),
        ("<|im_end|>", (), ""),
    ],
)
def test_special_tokens_stop_a_reply_and_are_no_text(message, stop, text, start, vllm):
    model = start()
    tokenizer = model._loaded.tokenizer
    vllm.would_say = tokenizer(message, add_special_tokens=False)["input_ids"]
    reply = model.answer(user("x"), up_to(50, stop=stop))
    assert reply.text == text
    assert len(reply.token_ids) == reply.n_reply_tokens
    ends = {tokenizer.convert_tokens_to_ids(end) for end in ("<|im_end|>", "<|endoftext|>")}
    assert not ends & set(reply.token_ids)
    assert ends <= set(vllm.calls[-1].params.stop_token_ids)
    assert (tokenizer.convert_tokens_to_ids(SPECIAL) in vllm.calls[-1].params.stop_token_ids) == (
        SPECIAL in stop
    )


def test_draws_are_the_requests_own(start, vllm):
    model = start()
    replies = [
        model.answer(user("Say it."), up_to(8, temperature=2.0, top_p=0.9, seed=seed))
        for seed in (3, 4, 3)
    ]
    assert replies[0].text == replies[2].text != replies[1].text
    params = vllm.calls[-1].params
    assert (params.temperature, params.top_p, params.seed) == (2.0, 0.9, 3)
    model.answer(user("Say it."), up_to(8))
    assert (vllm.calls[-1].params.temperature, vllm.calls[-1].params.seed) == (0, None)


def test_a_reply_is_held_to_choices_and_no_stop_string_cuts_it(start, in_process, vllm, frames):
    decoding = up_to(30, choices=("on the table", "in the sink"), stop=("the",))
    turns = user(frames[0], "Where is the mug?")
    ours, theirs = start().answer(turns, decoding), in_process("qwen2.5-vl").answer(turns, decoding)
    assert facts(ours) == facts(theirs)
    params = vllm.calls[-1].params
    assert params.structured_outputs is not None
    assert (params.structured_outputs.choice, params.stop) == (["on the table", "in the sink"], [])


def test_a_choice_that_does_not_fit_is_refused_before_vllm_is_asked(start, vllm):
    with pytest.raises(ModelError, match=r"has .* tokens and a reply may have 2"):
        start().answer(user("x"), up_to(2, choices=("on the kitchen table",)))
    assert vllm.calls == []


def test_a_reply_that_is_no_choice_fails(start, vllm):
    model = start()
    vllm.would_say = model._loaded.tokenizer("mug", add_special_tokens=False)["input_ids"]
    with pytest.raises(
        ModelError, match=r"vLLM 0\.33\.0 answers 'mug', which is none of the 2 choices"
    ):
        model.answer(user("x"), up_to(20, choices=("yes", "no")))


def test_a_processor_that_joins_words_and_frames_is_refused_before_vllm_starts(start, vllm):
    # Gemma 3 makes one token of the line breaks after a frame and before the words that follow.
    with pytest.raises(
        ModelError, match=r"token ids differ .*: gemma3 cannot be run in vLLM; use --engine transf"
    ):
        start("gemma3-line-breaks", "hf-vlm")
    assert vllm.started == []


# What its cache finds.


def _talk(model, *parts):
    talk = model.conversation()
    talk.append(*parts)
    return talk


def test_of_continuations_the_first_goes_alone_and_the_others_find_its_prefix(
    start, in_process, vllm, frames
):
    requests = [[f"\nQuestion {number}: what is it?"] for number in range(5)]
    replies = _talk(start(), *frames).replies(requests, up_to(4))
    assert [len(call.prompts) for call in vllm.calls] == [1, 4]
    theirs = _talk(in_process("qwen2.5-vl"), *frames).replies(requests, up_to(4))
    assert [facts(reply) for reply in replies] == [facts(reply) for reply in theirs]
    shared = _talk(start(), *frames).n_tokens // 16 * 16 - 16
    assert replies[0].n_cached_tokens == 0
    assert all(reply.n_cached_tokens >= shared > 0 for reply in replies[1:])


def test_what_was_just_read_is_warm_already(start, vllm, frames):
    talk = _talk(start(), *frames)
    talk.replies([["\nOne?"], ["\nTwo?"]], up_to(2))
    more = talk.replies([["\nThree?"], ["\nFour?"]], up_to(2))
    assert [len(call.prompts) for call in vllm.calls] == [1, 1, 2]
    assert all(reply.n_cached_tokens > 0 for reply in more)


def test_the_first_of_each_context_go_together_and_then_the_others(start, in_process, vllm, frames):
    contexts = [frames[:3], frames[:3], frames[3:], frames[3:]]
    requests = [[*context, f"\nQuestion {number}?"] for number, context in enumerate(contexts)]
    requests.append([frames[0], "\nAlone?"])
    replies = start().conversation().replies(requests, up_to(4))
    assert [len(call.prompts) for call in vllm.calls] == [3, 2]
    assert min(replies[1].n_cached_tokens, replies[3].n_cached_tokens) > 40
    theirs = [
        in_process("qwen2.5-vl").conversation().replies([parts], up_to(4))[0] for parts in requests
    ]
    assert [facts(reply) for reply in replies] == [facts(reply) for reply in theirs]


def test_without_a_cache_all_go_together(start, vllm, frames):
    replies = _talk(start(prefix_caching=False), *frames).replies(
        [["\nOne?"], ["\nTwo?"]], up_to(2)
    )
    assert [len(call.prompts) for call in vllm.calls] == [2]
    assert [reply.n_cached_tokens for reply in replies] == [0, 0]
    assert vllm.started[0]["enable_prefix_caching"] is False


def test_other_frames_are_no_warm_prefix(start, frames):
    model = start()
    first = model.answer(user(*frames[:3], "What?"), up_to(2))
    other = model.answer(user(*frames[3:], "What?"), up_to(2))
    again = model.answer(user(*frames[:3], "Where?"), up_to(2))
    # A block of the template's own words.
    assert (first.n_cached_tokens, other.n_cached_tokens) == (0, 16)
    assert again.n_cached_tokens == 48


def test_frames_are_sent_once_each_by_name_and_loaded_once(start, vllm, frames, monkeypatch):
    loaded = []
    plain = FrameRef.load
    monkeypatch.setattr(FrameRef, "load", lambda self: loaded.append(self.path) or plain(self))
    talk = _talk(start(), frames[0], frames[1], frames[0])
    talk.replies([["\nOne?"], ["\nTwo?"]], up_to(2))
    prompt = vllm.calls[0].prompts[0]
    assert prompt["multi_modal_uuids"] == {"image": [frames[at].digest for at in (0, 1, 0)]}
    assert len(prompt["multi_modal_data"]["image"]) == 3
    assert loaded == [frames[0].path, frames[1].path]


# What does not fit, and what fails.


def test_what_does_not_fit_is_refused_before_vllm_is_asked(start, vllm, frames):
    model = start(max_model_len=60)
    assert model.capabilities.max_tokens == 60 == vllm.started[0]["max_model_len"]
    with pytest.raises(
        ModelError,
        match=r"a context of \d+ tokens and 50 new ones is beyond the 60 .* set max_model_len",
    ):
        model.answer(user(frames[0], "What?"), up_to(50))
    assert vllm.calls == []


def test_more_frames_than_reserved_are_refused(start, vllm, frames):
    model = start(max_frames=2)
    assert vllm.started[0]["limit_mm_per_prompt"]["image"]["count"] == 2
    with pytest.raises(
        ModelError, match=r"3 frames are more than max_frames=2 of qwen2.5-vl@vllm; raise it"
    ):
        model.answer(user(*frames[:3]), up_to(2))
    model.answer(user(*frames[:2]), up_to(2))


def test_frames_reserved_are_as_many_as_fit(start, vllm):
    start(max_model_len=1_300)
    assert vllm.started[0]["limit_mm_per_prompt"] == {
        "image": {"count": 10, "width": 300, "height": 300},
        "video": 0,
    }


def test_a_vllm_that_counts_otherwise_is_not_believed(start, vllm):
    model = start()
    vllm.expands = True
    with pytest.raises(
        ModelError, match=r"vLLM 0\.33\.0 reads \d+ tokens where .* makes \d+: it processes frames"
    ):
        model.answer(user("x"), up_to(2))


@pytest.mark.parametrize(
    "error",
    [
        RuntimeError("CUDA out of memory.\nTried to allocate 20 GiB."),
        type("EngineDeadError", (Exception,), {})("EngineCore encountered an issue."),
        ValueError("At most 1 image(s) may be provided in one prompt."),
    ],
)
def test_what_vllm_says_to_a_request_is_one_line(error, start, vllm):
    model = start()
    vllm.fails = error
    with pytest.raises(
        ModelError, match=r"@vllm: vLLM 0\.33\.0 fails on the request \(.*\); use fewer"
    ) as raised:
        model.answer(user("x"), up_to(2))
    assert "\n" not in str(raised.value)
    assert " ".join(str(error).split()) in str(raised.value)


def test_a_vllm_that_does_not_start_says_so_in_one_line(start, vllm):
    vllm.fails = RuntimeError("Engine core initialization failed.\nSee root cause above.")
    with pytest.raises(
        ModelError, match=r"does not start \(Engine core initialization failed. See .*max_model_len"
    ):
        start()


def test_without_vllm_the_line_says_what_to_install(checkpoints, monkeypatch):
    monkeypatch.setitem(sys.modules, "vllm", None)
    for name in ("qwen2.5-vl@vllm", "hf-vlm@vllm", "openvla@vllm"):
        with pytest.raises(
            ModelError, match=rf"{name} needs the package vllm .*pip install 'infthor-eval\[vllm\]'"
        ):
            load(name, {"pretrained": str(checkpoints["qwen2.5-vl"])}, 0)


def test_a_checkpoint_of_another_family_is_refused_as_in_transformers(start, vllm):
    with pytest.raises(ModelError, match="is a llava checkpoint, not qwen2_5_vl; try hf-vlm"):
        start("llava", "qwen2.5-vl")
    with pytest.raises(UsageError, match=r"hf-vlm@vllm needs pretrained="):
        load("hf-vlm@vllm", {}, 0)
    assert vllm.started == []


def test_identities_tell_engines_and_what_changes_a_number_apart(start, in_process):
    plain, theirs = start().identity(), in_process("qwen2.5-vl").identity()
    assert (plain["engine"], plain["versions"]["vllm"]) == ("vllm", "0.33.0")
    assert plain["fingerprint"] == theirs["fingerprint"]
    assert plain["n_parameters"] == theirs["n_parameters"]
    changed = [
        {"enforce_eager": True},
        {"max_model_len": 999},
        {"quantization": "fp8"},
        {"rope": "yarn:2"},
    ]
    others = [start(**options).identity() for options in changed]
    assert all(one != other for at, one in enumerate([plain, *others]) for other in others[at:])
    assert start(gpu_memory_utilization=0.5, mm_processor_cache_gb=1).identity() == plain


@pytest.mark.parametrize("daemon", [True, False])
def test_in_a_worker_vllm_starts_no_processes_and_its_log_is_no_output(daemon, vllm, monkeypatch):
    names = ("VLLM_LOGGING_STREAM", "VLLM_ENABLE_V1_MULTIPROCESSING")
    for name in names:
        monkeypatch.setenv(name, "")  # so that what is set is taken back
        monkeypatch.delenv(name)
    monkeypatch.setattr("multiprocessing.current_process", lambda: SimpleNamespace(daemon=daemon))
    import_vllm("x")
    assert [os.environ.get(name) for name in names] == ["ext://sys.stderr", "0" if daemon else None]


def test_the_double_takes_no_argument_that_vllm_does_not_take(vllm):
    top = sys.modules["vllm"]
    for call in (
        lambda: top.LLM(model="x", image_limit=3),
        lambda: top.SamplingParams(max_new_tokens=3),
        lambda: sys.modules["vllm.sampling_params"].StructuredOutputsParams(choices=["a"]),
    ):
        with pytest.raises(TypeError, match="unexpected keyword argument"):
            call()


def test_decoding_that_vllm_refuses_is_told(start):
    with pytest.raises(ModelError, match=r"temperature must be in \[0, 2\]"):
        start().answer(user("x"), Decoding(max_new_tokens=2, temperature=3.0))


def test_margins_are_of_the_two_likeliest_tokens(start):
    talk = start(margins="true").conversation()
    talk.append("What is it?")
    reply = talk.reply(up_to(3))
    assert reply.margins == pytest.approx([2.0] * len(reply.margins))
    assert len(reply.margins) >= len(reply.token_ids)
    talk = start().conversation()
    talk.append("What is it?")
    assert talk.reply(up_to(3)).margins is None
