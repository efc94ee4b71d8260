"""A stand-in for vLLM: it takes the arguments that vLLM 0.33.0 takes and no other, and answers by
transformers.

What it reads it expands and computes with the checkpoint's whole weights, by `generate`, with
nothing of the adapters in between; so equal replies say that prompts, frames and sampling arrive as
they are meant. Its prefix cache is a count: blocks of 16 tokens that an earlier call (not an
earlier request of the same call) has read.
"""

import functools
import hashlib
import inspect
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import torch
from PIL import Image
from transformers import StoppingCriteriaList

from model_adapters.hf.families.hf_lm import HfLm, TextFamily
from model_adapters.hf.families.hf_vlm import ProcessorFamily, family_of
from model_adapters.hf.loading.checkpoint import load_checkpoint, locate
from model_adapters.hf.loading.processors import load_processor
from model_adapters.options.checkpoints import CheckpointOptions
from model_adapters.policies.decoding import embed_ids
from model_adapters.policies.openvla.adapter import OpenVLA
from model_adapters.policies.preprocessing import resize

SIGNATURES: dict[str, Any] = json.loads((Path(__file__).parent / "signatures.json").read_text())
_BLOCK = 16
_DTYPES = ("auto", "bfloat16", "float16", "float32", "half", "float")


def _checked(of: str, arguments: Mapping[str, Any], *more: str) -> dict[str, Any]:
    unknown = set(arguments) - set(SIGNATURES[of]).union(*(SIGNATURES[name] for name in more))
    if unknown:
        raise TypeError(f"{of} got an unexpected keyword argument {sorted(unknown)}")
    return dict(arguments)


class StructuredOutputsParams:
    def __init__(self, **arguments: Any) -> None:
        self.choice: list[str] = _checked("StructuredOutputsParams", arguments)["choice"]


class SamplingParams:
    """The settings with vLLM's defaults, as far as they are used."""

    def __init__(self, **arguments: Any) -> None:
        _checked("SamplingParams", arguments)
        if not 0 <= arguments.get("temperature", 1.0) <= 2:
            raise ValueError("temperature must be in [0, 2]")
        self.max_tokens: int = arguments.get("max_tokens", 16)
        self.temperature: float = arguments.get("temperature", 1.0)
        self.top_p: float = arguments.get("top_p", 1.0)
        self.seed: int | None = arguments.get("seed")
        self.stop: list[str] = arguments.get("stop", [])
        self.stop_token_ids: list[int] = arguments.get("stop_token_ids", [])
        self.repetition_penalty: float = arguments.get("repetition_penalty", 1.0)
        self.logprobs: int | None = arguments.get("logprobs")
        self.ignore_eos: bool = arguments.get("ignore_eos", False)
        self.allowed_token_ids: list[int] | None = arguments.get("allowed_token_ids")
        self.structured_outputs: StructuredOutputsParams | None = arguments.get(
            "structured_outputs"
        )


@dataclass
class _Read:
    """A prompt as the model reads it: its ids, each with the name of the frame that it belongs
    to."""

    ids: list[int]
    keys: list[tuple[int, str]]


class _Vlm:
    """A checkpoint that can be talked to."""

    def __init__(self, arguments: Mapping[str, Any]) -> None:
        dtype = arguments.get("dtype", "auto")
        options = CheckpointOptions(pretrained=arguments["model"], dtype=dtype, device="cpu")
        is_text = "limit_mm_per_prompt" not in arguments
        located = HfLm.locate("hf-lm", options) if is_text else locate(options)
        for part, changed in arguments.get("hf_overrides", {}).items():
            if is_text:
                setattr(located.config, part, changed)
                continue
            for name, value in changed.items():
                setattr(getattr(located.config, part), name, _as_read(name, value))
        family = TextFamily if is_text else family_of(located.config)
        if family is None:
            family = functools.partial(ProcessorFamily, processor=load_processor(located))
        self._loaded = load_checkpoint(located, family)
        if arguments.get("kv_cache_dtype", "auto").startswith("fp8"):
            _round_keys_and_values(self._loaded.model)
        self.limit: int = located.config.get_text_config().max_position_embeddings

    def read(
        self, ids: Sequence[int], images: Sequence[Image.Image], names: Sequence[str]
    ) -> _Read:
        family, prompt_read, frames = (
            self._loaded.family,
            _Read([], []),
            iter(zip(images, names, strict=True)),
        )
        for token in ids:
            expanded, name = (token,), ""
            if token == family.placeholder_id:
                image, name = next(frames)
                expanded = family.frame_ids(image.size)
            prompt_read.ids.extend(expanded)
            prompt_read.keys.extend((each, name) for each in expanded)
        assert next(frames, None) is None, "more images than placeholders"
        return prompt_read

    def write(
        self, ids: list[int], images: Sequence[Image.Image], params: SamplingParams
    ) -> tuple[list[int], str]:
        tokenizer, model = self._loaded.tokenizer, self._loaded.model

        def decode(written: Sequence[int]) -> str:
            return str(tokenizer.decode(list(written), skip_special_tokens=True))

        def stopped(rows: torch.Tensor, scores: Any, **_: Any) -> torch.Tensor:
            text = decode(rows[0, len(ids) :].tolist())
            return torch.tensor([any(stop in text for stop in params.stop)])

        ends = sorted({*params.stop_token_ids, tokenizer.eos_token_id})
        held = _held(tokenizer, params.structured_outputs, len(ids), ends)
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(params.seed or 0)
            output = model.generate(
                **self._inputs(ids, images),
                max_new_tokens=params.max_tokens,
                do_sample=params.temperature > 0,
                **(
                    {"temperature": params.temperature, "top_p": params.top_p, "top_k": 0}
                    if params.temperature
                    else {}
                ),
                repetition_penalty=params.repetition_penalty,
                eos_token_id=ends,
                stopping_criteria=StoppingCriteriaList([stopped]),
                prefix_allowed_tokens_fn=held,
            )
        written = output[0, len(ids) :].tolist()
        return written, decode(written)

    def cut(self, ids: Sequence[int], params: SamplingParams) -> tuple[list[int], str]:
        """What vLLM gives back of a model that would say this: up to the token that ends it."""
        tokenizer = self._loaded.tokenizer
        for n in range(1, len(ids) + 1):
            text = str(tokenizer.decode(list(ids[:n]), skip_special_tokens=True))
            if ids[n - 1] in params.stop_token_ids or any(stop in text for stop in params.stop):
                return list(ids[:n]), text
        return list(ids), text

    def _inputs(self, ids: list[int], images: Sequence[Image.Image]) -> dict[str, Any]:
        rows = torch.tensor([ids])
        inputs: dict[str, Any] = {"input_ids": rows, "attention_mask": torch.ones_like(rows)}
        takes = inspect.signature(self._loaded.model.forward).parameters
        if images:
            processed = self._loaded.family._image_processor(
                images=list(images), return_tensors="pt"
            )
            inputs |= {name: value for name, value in processed.items() if name in takes}
        if "mm_token_type_ids" in takes:
            inputs["mm_token_type_ids"] = (rows == self._loaded.family.slot_id).int()
        return inputs


def _round_keys_and_values(model: torch.nn.Module) -> None:
    def rounded(module: Any, inputs: Any, output: torch.Tensor) -> torch.Tensor:
        return output.to(torch.float8_e4m3fn).to(output.dtype)

    for name, part in model.named_modules():
        if name.endswith(("k_proj", "v_proj")) and "visual" not in name:
            part.register_forward_hook(rounded)


def _held(
    tokenizer: Any, outputs: StructuredOutputsParams | None, n: int, ends: list[int]
) -> Callable[..., Any] | None:
    if outputs is None:
        return None
    spelled = [tokenizer(text, add_special_tokens=False)["input_ids"] for text in outputs.choice]

    def allowed(_: int, row: torch.Tensor) -> list[int]:
        written = row[n:].tolist()
        begun = [ids for ids in spelled if ids[: len(written)] == written]
        return [ids[len(written)] for ids in begun if len(ids) > len(written)] + (
            ends if written in spelled else []
        )

    return allowed


class _OpenVLA:
    """A policy: patches go in behind the first token, and everything is computed anew for every
    token."""

    limit = 2048
    cut = None  # it says nothing

    def __init__(self, arguments: Mapping[str, Any]) -> None:
        options = OpenVLA.Options(
            pretrained=arguments["model"], dtype=arguments["dtype"], device="cpu"
        )
        self._network = OpenVLA.build("openvla", options, 0)._network

    def read(
        self, ids: Sequence[int], images: Sequence[Image.Image], names: Sequence[str]
    ) -> _Read:
        assert len(images) == 1, "OpenVLA takes one image"
        n_patches = self._patches(images[0]).shape[1]
        expanded = [ids[0], *[32_000] * n_patches, *ids[1:]]
        return _Read(expanded, [(token, names[0] if token == 32_000 else "") for token in expanded])

    @torch.inference_mode()
    def write(
        self, ids: list[int], images: Sequence[Image.Image], params: SamplingParams
    ) -> tuple[list[int], str]:
        assert params.temperature == 0 and params.ignore_eos
        model, patches = self._network.weights.language_model, self._patches(images[0])
        text, written = [token for token in ids if token != 32_000], []
        assert text[-1] == 29_871
        for _ in range(params.max_tokens):
            embeds = embed_ids(model, text + written)
            logits = model(
                inputs_embeds=torch.cat([embeds[:, :1], patches, embeds[:, 1:]], dim=1)
            ).logits[0, -1]
            held = torch.full_like(logits, -torch.inf)
            allowed = torch.tensor(params.allowed_token_ids or range(len(logits)))
            held[allowed] = logits[allowed]
            written.append(int(held.argmax()))
        return written, ""

    @torch.inference_mode()
    def _patches(self, image: Image.Image) -> torch.Tensor:
        weights = self._network.weights
        patches: torch.Tensor = weights.projector(
            weights.vision_backbone(resize(image, self._network.image_size)[None])
        )
        return patches


@dataclass
class _Call:
    """One call of `generate`.

    Attributes:
        prompts: as they were given.
        params: likewise.
    """

    prompts: list[dict[str, Any]]
    params: SamplingParams


@dataclass
class Double:
    """What a test sees of it.

    Attributes:
        started: arguments of each LLM.
        calls: of all of them, in order.
        fails: raised instead of an answer, once there is one.
        expands: one token more for every prompt, if true: another version's processor.
        would_say: ids that the next replies begin with, instead of the model's own.
        on_cpu: whether it says that it runs on a CPU.
    """

    started: list[dict[str, Any]] = field(default_factory=list)
    calls: list[_Call] = field(default_factory=list)
    fails: Exception | None = None
    expands: bool = False
    would_say: Sequence[int] = ()
    on_cpu: bool = False

    def modules(self) -> dict[str, ModuleType]:
        """What `import vllm` is to find, by name."""
        top, params, platforms = (
            ModuleType(name) for name in ("vllm", "vllm.sampling_params", "vllm.platforms")
        )
        vars(platforms).update(current_platform=SimpleNamespace(is_cpu=lambda: self.on_cpu))
        vars(top).update(
            LLM=functools.partial(_LLM, self),
            SamplingParams=SamplingParams,
            __version__=SIGNATURES["version"],
        )
        vars(params).update(
            StructuredOutputsParams=StructuredOutputsParams, SamplingParams=SamplingParams
        )
        return {module.__name__: module for module in (top, params, platforms)}


class _LLM:
    def __init__(self, double: Double, model: str, **engine_arguments: Any) -> None:
        self._double = double
        arguments = _checked("LLM", {"model": model, **engine_arguments}, "EngineArgs")
        assert arguments.get("dtype", "auto") in _DTYPES
        double.started.append(arguments)
        if double.fails is not None:
            raise double.fails
        kind = json.loads((Path(model) / "config.json").read_text())["model_type"]
        self._model: _Vlm | _OpenVLA = _OpenVLA(arguments) if kind == "openvla" else _Vlm(arguments)
        self._most_frames = _count(arguments.get("limit_mm_per_prompt", {}).get("image", 0))
        self._limit = arguments.get("max_model_len", self._model.limit)
        self._caches = arguments.get("enable_prefix_caching", True)
        self._seen: list[list[tuple[int, str]]] = []

    def generate(
        self, prompts: Any, sampling_params: SamplingParams | None = None, **arguments: Any
    ) -> list[Any]:
        _checked("LLM.generate", arguments)
        double = self._double
        double.calls.append(_Call(prompts, sampling_params or SamplingParams()))
        if double.fails is not None:
            raise double.fails
        read = [self._read(prompt) for prompt in prompts]
        cached = [self._cached(prompt_read.keys) for prompt_read in read]
        self._seen.extend(prompt_read.keys for prompt_read in read)
        return [
            self._output(prompt, prompt_read, n, double.calls[-1].params)
            for prompt, prompt_read, n in zip(prompts, read, cached, strict=True)
        ]

    def _read(self, prompt: dict[str, Any]) -> _Read:
        _checked("TokensPrompt", prompt)
        images = prompt.get("multi_modal_data", {}).get("image", [])
        names = prompt.get("multi_modal_uuids", {}).get("image") or [
            _hash(image) for image in images
        ]
        if len(images) > self._most_frames:
            raise ValueError(f"At most {self._most_frames} image(s) may be provided in one prompt.")
        prompt_read = self._model.read(prompt["prompt_token_ids"], images, names)
        if len(prompt_read.ids) >= self._limit:
            raise ValueError(f"longer than the maximum model length of {self._limit}")
        return prompt_read

    def _cached(self, keys: list[tuple[int, str]]) -> int:
        if not self._caches:
            return 0
        common = max((_n_common(keys, seen) for seen in self._seen), default=0)
        return min(common, len(keys) - 1) // _BLOCK * _BLOCK

    def _output(
        self, prompt: dict[str, Any], read: _Read, cached: int, params: SamplingParams
    ) -> Any:
        images = prompt.get("multi_modal_data", {}).get("image", [])
        scripted_ids = self._double.would_say
        ids, text = (
            self._model.cut(scripted_ids, params)
            if scripted_ids
            else self._model.write(read.ids, images, params)
        )
        prompt_ids = read.ids + [0] * self._double.expands
        likely = None if params.logprobs is None else [_likely(token) for token in ids]
        completion = SimpleNamespace(token_ids=ids, text=text, logprobs=likely)
        return SimpleNamespace(
            outputs=[completion], prompt_token_ids=prompt_ids, num_cached_tokens=cached
        )


def _likely(token: int) -> dict[int, Any]:
    """A token two nats ahead of the second likeliest."""
    return {token + 1: SimpleNamespace(logprob=-2.1), token: SimpleNamespace(logprob=-0.1)}


def _as_read(name: str, value: Any) -> Any:
    """What vLLM makes of an override: for positions on three axes it multiplies YaRN's original
    length by four."""
    if name != "rope_parameters" or "mrope_section" not in value:
        return value
    return value | {
        "original_max_position_embeddings": 4 * value["original_max_position_embeddings"]
    }


def _count(limit: int | dict[str, int]) -> int:
    return limit if isinstance(limit, int) else limit["count"]


def _hash(image: Image.Image) -> str:
    return hashlib.sha256(image.tobytes()).hexdigest()


def _n_common(one: Sequence[Any], other: Sequence[Any]) -> int:
    return next(
        (at for at, (a, b) in enumerate(zip(one, other, strict=False)) if a != b),
        min(len(one), len(other)),
    )
