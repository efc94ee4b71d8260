"""How conversations are written: by a checkpoint's own template, or plainly, as transformers'
processors take them."""

import json
import re
import shutil
from types import SimpleNamespace

import pytest
from transformers import AutoTokenizer

from infthor_eval.errors import ModelError, UsageError
from model_adapters import Turn, check_adapter, load, registry
from model_adapters.built_in import BUILT_IN
from model_adapters.hf.families.hf_vlm import ProcessorFamily
from model_adapters.hf.prompting.templates import chat_template, plain_template
from model_adapters.hf.uncached import UncachedModel
from model_adapters.tiny.tokenizer import train_tokenizer

from ...asking import load_saved, require_same, talk_of, user
from ...checkpoints import FAMILIES, OTHERS

NEW = 6
# Nobody converses with these.
POLICIES = {"openvla", "openvla@vllm", "openvla-tiny", "spatialvla", "spatialvla-tiny"}
POLICIES |= {"openpi", "vla-eval", "vla-http"}
IMAGES = {
    "qwen2.5-vl": "<|vision_start|><|image_pad|><|vision_end|>",
    "llava-onevision": "<image>",
    "deepseek-vl": "<image_placeholder>",
    "pixtral": "[IMG]",
    "llava": "<image>",
    "idefics3": "<image>",
    "deepseek-vl-1.3b": "<image_placeholder>",
    "gemma3": "<start_of_image>",
}
BEGINS = {
    "qwen2.5-vl": "",
    "llava-onevision": "",
    "deepseek-vl": "<｜begin▁of▁sentence｜>",
    "pixtral": "<s>",
}
# What a plain prompt is, said again.
TEMPLATE = """\
{%- for message in messages -%}{%- for part in message.content -%}
{%- if part.type == 'image' -%}IMAGE{%- else -%}{{- part.text -}}{%- endif -%}
{%- endfor -%}{%- endfor -%}
"""


@pytest.fixture(scope="module")
def conversations(frames):
    return [
        (
            Turn(
                "user",
                ("<|goal|>Wash {{ it }}.  <|goal|>", *frames[:2], "\nMove", frames[2], "Ahead "),
            ),
        ),
        (
            Turn("system", ("You wash.\n",)),
            Turn("user", (frames[0],)),
            Turn("assistant", ("LookUp",)),
            Turn("user", ("Now? ", frames[1])),
        ),
    ]


def _load(name, folder, **options):
    defaults = {"dtype": "float32", "max_tokens": 0, "prompt": "plain"}
    return load_saved(name if name in FAMILIES else "hf-vlm", folder, **defaults | options)


def _without_template(checkpoint, folder):
    shutil.copytree(checkpoint, folder)
    (folder / "chat_template.jinja").unlink()
    return folder


@pytest.mark.parametrize("family", FAMILIES)
def test_turns_are_written_one_after_the_other(family, conversations):
    model = load(f"{family}-tiny", {"prompt": "plain"}, seed=0)
    placeholder = model._loaded.family.placeholder_id
    texts = ["<|goal|>Wash {{ it }}.  <|goal|>@@\nMove@Ahead ", "You wash.\n@LookUpNow? @"]
    for turns, text in zip(conversations, texts, strict=True):
        ids = [piece if isinstance(piece, int) else placeholder for piece in model.pieces(turns)]
        assert model._loaded.tokenizer.decode(ids) == BEGINS[family] + text.replace(
            "@", IMAGES[family]
        )


def test_ids_and_replies_are_those_of_transformers_on_the_bare_sequence(
    checkpoints, tmp_path, conversations, answer_plainly
):
    # Like gemma3 but for its vocabulary.
    names = (*FAMILIES, *OTHERS.keys() - {"gemma3-line-breaks"})
    folders = {name: _without_template(checkpoints[name], tmp_path / name) for name in names}
    models = {name: [_load(name, folders[name], share_prefix="false")] for name in names}
    for name in (*FAMILIES, "llava", "idefics3", "deepseek-vl-1.3b"):
        models[name].append(_load(name, folders[name], chunk_tokens="50"))
    for name in names:
        (folders[name] / "chat_template.jinja").write_text(TEMPLATE.replace("IMAGE", IMAGES[name]))
    plainly = answer_plainly(dict.fromkeys(folders.values(), conversations), NEW)
    for name in names:
        for model in models[name]:
            for turns, (ids, reply) in zip(conversations, plainly[folders[name]], strict=True):
                require_same(model, turns, ids, reply, NEW)


@pytest.mark.parametrize("name", ["qwen2.5-vl", "llava"])
def test_a_checkpoint_without_a_template_is_asked_plainly_or_not_at_all(
    name, checkpoints, tmp_path
):
    folder = _without_template(checkpoints[name], tmp_path / "bare")
    for share_prefix in ("true", "false"):
        with pytest.raises(ModelError, match=r"has no chat template; add .*, or set prompt=plain"):
            _load(name, folder, prompt="chat", share_prefix=share_prefix)
        check_adapter(_load(name, folder, share_prefix=share_prefix))


NAMED = [{"name": "tool_use", "template": "T"}, {"name": "default", "template": "D"}]


@pytest.mark.parametrize(
    ("files", "template"),
    [
        ({"tokenizer_config.json": {"chat_template": NAMED}}, "D"),
        ({"chat_template.json": {"chat_template": "D"}}, "D"),
        ({"chat_template.json": {"chat_template": NAMED}}, "D"),
        ({"chat_template.json": {"chat_template": {"default": "D", "rag": "R"}}}, "D"),
        ({"processor_config.json": {"chat_template": "D"}}, "D"),
        ({"processor_config.json": {"chat_template": NAMED}}, "D"),
        ({"processor_config.json": {}, "chat_template.jinja": "D"}, "D"),
        ({"chat_template.jinja": "D", "additional_chat_templates/rag.jinja": "R"}, "D"),
        ({"additional_chat_templates/default.jinja": "D"}, "D"),
        # What only transformers' processor reads comes before what its tokenizer reads.
        ({"processor_config.json": {"chat_template": "D"}, "chat_template.jinja": "J"}, "D"),
        ({"chat_template.json": {"chat_template": "D"}, "chat_template.jinja": "J"}, "D"),
        ({"tokenizer_config.json": {"chat_template": NAMED[:1]}}, "named default (but tool_use)"),
        ({"additional_chat_templates/rag.jinja": "R"}, "named default (but rag)"),
        ({"tokenizer_config.json": {"chat_template": []}}, "no chat template"),
    ],
)
def test_of_all_places_and_names_transformers_default_is_taken(
    files, template, checkpoints, tmp_path
):
    folder = _without_template(checkpoints["llava"], tmp_path / "named")
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        known = json.loads(path.read_text()) if path.is_file() else {}
        path.write_text(content if isinstance(content, str) else json.dumps(known | content))
    tokenizer = AutoTokenizer.from_pretrained(folder)
    if len(template) == 1:
        assert chat_template(folder, tokenizer) == template
    else:
        with pytest.raises(ModelError, match=re.escape(template)):
            chat_template(folder, tokenizer)


def test_the_way_of_asking_is_part_of_the_identity(checkpoints):
    folder = checkpoints["llava"]
    for share_prefix in ("true", "false"):
        plain, chat = (
            _load("llava", folder, share_prefix=share_prefix, prompt=prompt).identity()
            for prompt in ("plain", "chat")
        )
        assert (plain["prompt"], chat["prompt"]) == ("plain", "chat")
        assert plain["chat_template"] != chat["chat_template"]
    default, chat = (
        load("qwen2.5-vl-tiny", prompt_option, seed=0).identity()
        for prompt_option in ({}, {"prompt": "chat"})
    )
    assert default == chat


def test_the_model_without_sharing_is_asked_plainly_too(checkpoints, frames):
    plain, chat = (
        _load("gemma3", checkpoints["gemma3"], share_prefix=False, prompt=prompt)
        for prompt in ("plain", "chat")
    )
    assert isinstance(plain, UncachedModel)
    turns = user("mug", frames[0])
    assert talk_of(plain, turns).n_tokens < talk_of(chat, turns).n_tokens


@pytest.mark.parametrize(
    "name", sorted(BUILT_IN.keys() - POLICIES - {"human", "openai", "anthropic", "gemini"})
)
def test_every_model_has_the_option(name):
    assert registry.options_of(name)["prompt"].default == "chat"
    with pytest.raises(UsageError, match="prompt=plane: give chat or plain"):
        registry.check_options(name, {"prompt": "plane"})


@pytest.mark.parametrize(
    ("config", "expanded", "written"),
    [
        ({}, "<image><image>", "<image>"),
        (
            {"vision_start_token_id": "<a>", "vision_end_token_id": "<z>"},
            "<image><image>",
            "<a><image><z>",
        ),
        ({"image_start_token_id": "<a>", "image_end_token_id": "<z>"}, "<image>", "<a><image><z>"),
        ({"image_start_token_id": "<a>", "image_end_token_id": "<z>"}, "<a><image><z>", "<image>"),
        ({"image_start_token_id": "<a>"}, "<image>", "<image>"),
    ],
)
def test_markers_around_a_frame_are_written_unless_the_processor_does(config, expanded, written):
    tokenizer = train_tokenizer(("</s>", "<image>", "<a>", "<z>"), end="</s>", pad="</s>", named={})
    ids = tokenizer.convert_tokens_to_ids
    settings = SimpleNamespace(
        image_token_id=ids("<image>"), **{name: ids(token) for name, token in config.items()}
    )

    class Processor:
        image_token = "<image>"

        def __call__(self, **_):
            return tokenizer([expanded], return_tensors="pt")

    family = ProcessorFamily(SimpleNamespace(config=settings), None, tokenizer, Processor())
    assert f'"{written}"' in plain_template(tokenizer, family)
