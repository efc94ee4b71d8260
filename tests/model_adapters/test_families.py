"""Every family by the same measure: transformers' own processor and generate, sharing on and off, black and white."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import torch
from PIL import Image

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters import Part, check_adapter, load, registry
from model_adapters.engine.prompt import token_ids

FAMILIES = {"qwen2.5-vl": 121 + 2, "llava-onevision": 1485, "deepseek-vl": 576, "pixtral": 380}
PEERS = Path(sys.prefix) / "test-peers"  # torchvision's Python half, kept out of the environment
NEW = 6

# Runs in a process of its own, because the stand-ins for torchvision's compiled half must come before transformers.
PROCESSORS = """
import json, sys
import torch
library = torch.library.Library("torchvision", "DEF")
for name in ("nms", "qnms"):
    library.define(name + "(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
torch.set_num_threads(1)
from PIL import Image
from transformers import AutoImageProcessor, AutoModelForImageTextToText, AutoProcessor
found = {}
for name, case in json.load(sys.stdin).items():
    processor = AutoProcessor.from_pretrained(case["folder"])
    processor.image_processor = AutoImageProcessor.from_pretrained(case["folder"], backend="pil")
    content = [{"type": kind, "text": value} if kind == "text" else {"type": kind} for kind, value in case["parts"]]
    text = processor.apply_chat_template([{"role": "user", "content": content}], add_generation_prompt=True)
    images = [Image.open(value) for kind, value in case["parts"] if kind == "image"]
    begin = processor.tokenizer.bos_token
    begun = begin is not None and text.startswith(begin)
    inputs = processor(text=[text], images=images, add_special_tokens=not begun, return_tensors="pt")
    model = AutoModelForImageTextToText.from_pretrained(case["folder"])
    output = model.generate(**inputs, do_sample=False, max_new_tokens=case["new"])
    ids = inputs["input_ids"][0].tolist()
    found[name] = [type(processor).__name__, ids, output[0, len(ids):].tolist()]
print(json.dumps(found))
"""


def _twin(family: str) -> Any:
    module, _, name = registry._BUILT_IN[f"{family}-tiny"].partition(":")
    return getattr(import_module(module), name).twin


@pytest.fixture(scope="module")
def checkpoints(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    root = tmp_path_factory.mktemp("checkpoints")
    for family in FAMILIES:
        _twin(family).save(root / family, seed=0)
    return {family: root / family for family in FAMILIES}


@pytest.fixture(scope="module")
def scene(make_frames: Callable[..., list[FrameRef]]) -> list[FrameRef]:
    return make_frames(3, 300, 300, seed=4)


@pytest.fixture(scope="module", params=FAMILIES)
def family(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def model(family: str, checkpoints: dict[str, Path]) -> Iterator[Any]:
    loaded: Any = load(family, {"pretrained": str(checkpoints[family]), "device": "cpu"}, seed=0)
    yield loaded
    loaded.close()


def _parts(scene: Sequence[FrameRef]) -> list[Part]:
    return ["Goal: wash the cup. ", scene[0], scene[1], "MoveAhead", scene[2], "\nWhat do you see now?"]


def _ask(model: Any, parts: Sequence[Part]) -> Any:
    talk = model.conversation()
    talk.append(*parts)
    return talk.reply(NEW)


@pytest.fixture(scope="module")
def peers(checkpoints: dict[str, Path], scene: list[FrameRef]) -> dict[str, Any]:
    if not PEERS.is_dir():
        pytest.skip("torchvision is not set aside in test-peers (make test does it)")
    parts = [("text", part) if isinstance(part, str) else ("image", str(part.path)) for part in _parts(scene)]
    cases = {name: {"folder": str(folder), "parts": parts, "new": NEW} for name, folder in checkpoints.items()}
    run = subprocess.run(
        [sys.executable, "-c", PROCESSORS],
        input=json.dumps(cases),
        check=True,
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(PEERS)},
    )
    return dict(json.loads(run.stdout.splitlines()[-1]))


def test_ids_and_reply_are_those_of_transformers_own_processor(
    family: str, model: Any, scene: list[FrameRef], peers: dict[str, Any]
) -> None:
    processor, ids, reply = peers[family]
    assert processor.endswith("Processor")
    assert list(token_ids(model.units(_parts(scene)))) == ids
    got = list(_ask(model, _parts(scene)).token_ids)
    assert got == reply[: len(got)]
    assert reply[len(got) :] == [] or reply[len(got)] in model._loaded.generation.end_ids


def test_a_frame_takes_the_published_number_of_tokens(family: str, model: Any, scene: list[FrameRef]) -> None:
    sizes = []
    for count in (1, 2):
        talk = model.conversation()
        talk.append(*scene[:count])
        sizes.append(talk.n_tokens)
    assert sizes[1] - sizes[0] == FAMILIES[family]
    assert model.tokens_per_frame(scene[0]) == FAMILIES[family] - (2 if family == "qwen2.5-vl" else 0)


def test_sharing_changes_no_reply(family: str, model: Any, checkpoints: dict[str, Path], scene: list[FrameRef]) -> None:
    options = {"pretrained": str(checkpoints[family]), "share_prefix": "false", "chunk_tokens": "100000"}
    plain = load(family, options, seed=0)

    def play(each: Any) -> list[Any]:
        talk, heard = each.conversation(), []
        talk.append(scene[0], "RotateLeft", scene[1])
        start = talk.mark()
        for question in ("\nWhat is it?", "\nWhat was it?"):
            talk.append(question)
            heard.append(talk.reply(NEW).token_ids)
            talk.rewind(start)
        talk.append("MoveAhead", scene[0], "\nWhere?")
        return [*heard, talk.reply(NEW).token_ids]

    assert play(model) == play(plain)


def test_a_black_and_a_white_frame_give_different_logits(model: Any, tmp_path: Path) -> None:
    logits = []
    for colour in ("black", "white"):
        path = tmp_path / f"{colour}.png"
        Image.new("RGB", (300, 300), colour).save(path)
        units = model.units((FrameRef(path), "\nIs it bright?"))
        model._prefix.reset()
        logits.append(model._prefix.feed(units))
    assert (logits[0] - logits[1]).abs().max() > 1e-3


def test_the_tiny_model_is_the_saved_one_and_keeps_its_contract(family: str, model: Any, scene: list[FrameRef]) -> None:
    tiny: Any = load(f"{family}-tiny", {}, seed=0)
    assert _ask(tiny, _parts(scene)).token_ids == _ask(model, _parts(scene)).token_ids
    check_adapter(tiny, frame_size=(200, 300))


def test_half_precision_works(family: str, checkpoints: dict[str, Path], scene: list[FrameRef]) -> None:
    options = {"pretrained": str(checkpoints[family]), "dtype": "bfloat16", "device": "cpu"}
    model: Any = load(family, options, seed=0)
    units = model.units((scene[0], "?"))
    assert model._prefix.feed(units).dtype == torch.bfloat16


def test_a_family_refuses_the_others_checkpoints(family: str, checkpoints: dict[str, Path]) -> None:
    other = next(name for name in FAMILIES if name != family)
    with pytest.raises(ModelError, match="checkpoint, not"):
        load(family, {"pretrained": str(checkpoints[other])}, seed=0)


def test_pixtral_refuses_another_llava(checkpoints: dict[str, Path], tmp_path: Path) -> None:
    twin = _twin("pixtral")
    vocabulary = {token: index for index, token in enumerate(("[IMG]", "<s>"))}
    tokenizer = twin.tokenizer()
    model = twin.model(tokenizer, twin.model_config(tokenizer), 0, "sdpa")
    tokenizer.get_vocab = lambda: vocabulary  # type: ignore[method-assign]
    with pytest.raises(ModelError, match=r"no \[IMG_BREAK\] or no \[IMG_END\]"):
        twin.family(model, twin.image_processor(), tokenizer)
    model.config.vision_config.model_type = "clip_vision_model"
    with pytest.raises(ModelError, match="without Pixtral's vision tower"):
        twin.family(model, twin.image_processor(), tokenizer)
