"""Serve OpenVLA and SpatialVLA with the libraries of their publication, behind `/act`, for
`check parity`.

pip install --no-deps --target OLD timm==0.9.16 transformers==4.47.0 tokenizers==0.21.0
huggingface_hub==0.27.0 PYTHONPATH=OLD python benchmarks/reference_policies.py openvla CHECKPOINT
--port 8000 infthor-eval check parity openvla --model-args pretrained=CHECKPOINT,dtype=float32
--reference-url http://127.0.0.1:8000

This implementation shares no code with `model_adapters`. Towers are timm's, all else is from
transformers 4.47, loaded strictly by the checkpoint's own names. Every token is computed from the
whole sequence, without a cache. CHECKPOINT can be that of a tiny model:
`OpenVLATiny.twin.save(folder, seed=0)`. It runs in float32 on the CPU, one process per policy.
"""

import argparse
import base64
import json
import math
from collections.abc import Callable
from functools import partial
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image
from safetensors.torch import load_file
from tokenizers import Tokenizer
from torch import nn
from torch.nn.functional import gelu, interpolate, linear, pad

Act = Callable[[Image.Image, str], np.ndarray]
Weights = dict[str, torch.Tensor]


def main() -> None:
    """Serve one of the policies until it is stopped."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("policy", choices=["openvla", "spatialvla"])
    parser.add_argument("checkpoint", type=Path)
    parser.add_argument("--port", type=int, default=8000)
    parser.add_argument("--unnorm-key")
    parser.add_argument(
        "--without-torchvision",
        action="store_true",
        help="Only the Python half of torchvision is installed.",
    )
    options = parser.parse_args()
    if options.without_torchvision:
        library = torch.library.Library("torchvision", "DEF")
        for name in ("nms", "qnms"):
            library.define(f"{name}(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
    make = {"openvla": openvla, "spatialvla": spatialvla}[options.policy]
    with torch.inference_mode():
        serve(make(options.checkpoint, options.unnorm_key), options.port)


def serve(act: Act, port: int) -> None:
    """Answer requests of the `/act` convention with actions as lists."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            request = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            sent = request["image"]
            pixels = np.frombuffer(base64.b64decode(sent["__numpy__"]), np.uint8).reshape(
                sent["shape"]
            )
            body = json.dumps(
                act(Image.fromarray(pixels), request["instruction"]).tolist()
            ).encode()
            self.send_response(200)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *args: Any) -> None:
            pass

    print(f"http://127.0.0.1:{port}/act", flush=True)
    HTTPServer(("127.0.0.1", port), Handler).serve_forever()


def read(folder: Path) -> tuple[dict[str, Any], Weights, Tokenizer]:
    """Return config, weights in float32, and tokenizer of a checkpoint."""
    weights: Weights = {}
    for path in sorted(folder.glob("*.safetensors")):
        weights |= {key: value.float() for key, value in load_file(path).items()}
    return (
        json.loads((folder / "config.json").read_text()),
        weights,
        Tokenizer.from_file(str(folder / "tokenizer.json")),
    )


def part(weights: Weights, prefix: str, **renamed: str) -> Weights:
    """Return the weights below a prefix, without the prefix in their names."""
    selected = {
        key.removeprefix(prefix): value for key, value in weights.items() if key.startswith(prefix)
    }
    for old, new in renamed.items():
        selected = {key.replace(old, new): value for key, value in selected.items()}
    return selected


def pixels_of(image: Image.Image, size: int) -> torch.Tensor:
    """Return the pixels [1, 3, size, size], from 0 to 1."""
    resized = np.asarray(
        image.convert("RGB").resize((size, size), Image.Resampling.BICUBIC), dtype=np.float32
    )
    return torch.from_numpy(resized / 255).permute(2, 0, 1)[None]


def unnormalize(actions: np.ndarray, known: dict[str, Any], key: str | None) -> np.ndarray:
    """Return actions in the units of a data set, the only one if `key` is None."""
    statistics = known[key or next(iter(known))]["action"]
    low, high = np.array(statistics["q01"]), np.array(statistics["q99"])
    return np.where(
        statistics.get("mask", [True] * len(low)), 0.5 * (actions + 1) * (high - low) + low, actions
    )


def towers(config: dict[str, Any], weights: Weights) -> list[nn.Module]:
    """Build OpenVLA's two towers with timm."""
    import timm
    from timm.models.vision_transformer import VisionTransformer

    result = []
    for number, name in enumerate(("featurizer", "fused_featurizer")):
        if "vision_towers" in config:  # of a tiny model
            shape = config["vision_towers"][number]
            kinds = {
                "dinov2": {"init_values": 1e-5, "reg_tokens": 4, "no_embed_class": True},
                "siglip": {"class_token": False, "global_pool": "map"},
            }
            tower = VisionTransformer(
                img_size=config["image_sizes"][number],
                patch_size=shape["patch"],
                embed_dim=shape["width"],
                depth=shape["depth"],
                num_heads=shape["heads"],
                mlp_ratio=(shape["mlp_width"] + 0.5) / shape["width"],  # timm rounds down
                num_classes=0,
                **kinds[shape["kind"]],
            )
        else:
            size = config["image_sizes"][number]
            tower = timm.create_model(
                config["timm_model_ids"][number], num_classes=0, img_size=size
            )
        tower.load_state_dict(part(weights, f"vision_backbone.{name}.", scale_factor="gamma"))
        result.append(tower.eval())
    return result


def openvla(folder: Path, key: str | None) -> Act:
    """Load OpenVLA with timm's towers and transformers' Llama."""
    from transformers import LlamaConfig, LlamaForCausalLM

    config, weights, tokenizer = read(folder)
    dino, siglip = towers(config, weights)
    model = LlamaForCausalLM(LlamaConfig(**config["text_config"])).eval()
    model.load_state_dict(part(weights, "language_model."))
    last = config["text_config"]["vocab_size"] - config["pad_to_multiple_of"]
    mean, std = (
        torch.tensor(x)[:, None, None]
        for x in ((0.484375, 0.455078125, 0.40625), (0.228515625, 0.2236328125, 0.224609375))
    )

    def project(features: torch.Tensor, layer: str) -> torch.Tensor:
        return linear(
            features, weights[f"projector.{layer}.weight"], weights[f"projector.{layer}.bias"]
        )

    def act(image: Image.Image, instruction: str) -> np.ndarray:
        pixels = pixels_of(image, config["image_sizes"][0])
        seen = ((dino, (pixels - mean) / std), (siglip, (pixels - 0.5) / 0.5))
        features = torch.cat(
            [tower.get_intermediate_layers(x, n={len(tower.blocks) - 2})[0] for tower, x in seen],
            dim=2,
        )
        patches = project(gelu(project(gelu(project(features, "fc1")), "fc2")), "fc3")
        ids = tokenizer.encode(
            f"In: What action should the robot take to {instruction.lower()}?\nOut:"
        ).ids
        ids += [] if ids[-1] == 29871 else [29871]
        written: list[int] = []
        for _ in range(7):
            text = model.model.embed_tokens(torch.tensor([ids + written]))
            logits = model(
                inputs_embeds=torch.cat([text[:, :1], patches, text[:, 1:]], 1), use_cache=False
            ).logits
            written.append(last - 256 + int(logits[0, -1, last - 256 : last].argmax()))
        borders = np.linspace(-1, 1, 256)
        middles = (borders[:-1] + borders[1:]) / 2
        return unnormalize(
            middles[np.clip(last - np.array(written) - 1, 0, 254)], config["norm_stats"], key
        )

    return act


def spatialvla(folder: Path, key: str | None) -> Act:
    """Load SpatialVLA with SigLIP, ZoeDepth and Gemma 2 of transformers 4.47."""
    from transformers import (
        AutoModel,
        Gemma2Config,
        Gemma2ForCausalLM,
        SiglipVisionConfig,
        ZoeDepthConfig,
        ZoeDepthForDepthEstimation,
    )

    config, weights, tokenizer = read(folder)
    processor = json.loads((folder / "processor_config.json").read_text())
    vision = SiglipVisionConfig(**config["vision_config"])
    siglip = AutoModel.from_config(vision).eval()
    siglip.load_state_dict(part(weights, "vision_tower."))
    zoe = ZoeDepthForDepthEstimation(ZoeDepthConfig(**config["vision_zoe_config"])).eval()
    zoe.load_state_dict(part(weights, "vision_zoe_model."))
    model = Gemma2ForCausalLM(Gemma2Config(**config["text_config"])).eval()
    model.load_state_dict(part(weights, "language_model."))
    spatial = weights["spatial_embed_tokens.weight"]
    model.model.embed_tokens.weight[-len(spatial) :] = spatial
    width, hidden = vision.hidden_size, model.config.hidden_size
    head = nn.Sequential(
        nn.Linear(12 * 17, width), nn.LayerNorm(width), nn.ReLU(), nn.Linear(width, width)
    )
    head.load_state_dict(part(weights, "position_embedding_3d.position_embedding_head."))
    project = partial(
        linear,
        weight=weights["multi_modal_projector.linear.weight"],
        bias=weights["multi_modal_projector.linear.bias"],
    )
    lift = partial(
        points,
        camera=processor["intrinsic_config"]["default"],
        size=vision.image_size,
        patch=vision.patch_size,
    )
    zoe_size = config["vision_zoe_config"]["backbone_config"]["image_size"]
    places = places_of(config["action_token_begin_idx"], processor["bin_policy"])

    def features(image: Image.Image) -> torch.Tensor:
        pixels = pixels_of(image, vision.image_size)
        border = int((vision.image_size / 2) ** 0.5 * 3)
        framed = pad(pixels, (border,) * 4, mode="reflect")
        shown = (
            interpolate(framed, size=(zoe_size,) * 2, mode="bicubic", align_corners=True) - 0.5
        ) / 0.5
        depth = zoe(pixel_values=shown).predicted_depth[:, None]
        depth = interpolate(depth, size=framed.shape[-2:], mode="bicubic", align_corners=True)
        near = (
            lift(depth[..., border:-border, border:-border])
            - torch.tensor([0.0, 0.0, 2.0]).repeat(4)
        ) / 2.0
        angles = near[..., None] * 2 ** torch.linspace(0, 7, 8)
        encoded = torch.cat([near[..., None], angles.sin(), angles.cos()], -1).reshape(
            *near.shape[:2], -1
        )
        return project(siglip((pixels - 0.5) / 0.5).last_hidden_state + head(encoded)) / hidden**0.5

    def act(image: Image.Image, instruction: str) -> np.ndarray:
        patches = features(image)
        text = (
            f"{'<image>' * patches.shape[1]}<bos>What action should the robot take to "
            f"{instruction}?\n"
        )
        ids = tokenizer.encode(text, add_special_tokens=False).ids
        written: list[int] = []
        for number in range(3 * processor["action_chunk_size"]):
            all_ids = torch.tensor([ids + written])
            embedded = model.model.embed_tokens(all_ids)
            embedded = embedded.masked_scatter(
                (all_ids == config["image_token_index"])[..., None], patches
            )
            length = all_ids.shape[1]
            mask = torch.full((length, length), torch.finfo(torch.float32).min).triu(1)
            mask[: len(ids), : len(ids)] = 0
            positions = torch.arange(1, length + 1)[None]
            output = model(
                inputs_embeds=embedded,
                attention_mask=mask[None, None],
                position_ids=positions,
                use_cache=False,
            )
            start, stop = places[number % 3]
            written.append(start + int(output.logits[0, -1, start:stop].argmax()))
        steps = np.array(
            [
                decode_action(written[at : at + 3], places, processor["bin_policy"])
                for at in range(0, len(written), 3)
            ]
        )
        return unnormalize(steps, processor["statistics"], key)

    return act


def points(depth: torch.Tensor, camera: dict[str, Any], size: int, patch: int) -> torch.Tensor:
    """Return four points per patch in camera coordinates."""
    matrix = torch.tensor(camera["intrinsic"]).float()
    matrix[:2] *= torch.tensor([size / camera["width"], size / camera["height"]])[:, None]
    y, x = torch.meshgrid(
        torch.arange(0, size, patch // 2), torch.arange(0, size, patch // 2), indexing="ij"
    )
    pixels = torch.stack([x + patch / 4, y + patch / 4, torch.ones_like(x)]).reshape(3, -1).float()
    side = size // patch
    cells = interpolate(depth, size=(2 * side, 2 * side), mode="area").reshape(1, 1, -1)
    lifted = (torch.linalg.inv(matrix)[None] @ pixels) * cells
    return (
        lifted.reshape(1, 3, side, 2, side, 2).permute(0, 2, 4, 3, 5, 1).reshape(1, side * side, -1)
    )


def places_of(begin: int, bins: dict[str, dict[str, list[float]]]) -> list[tuple[int, int]]:
    """Return the ranges of token ids of translations, rotations and grippers."""
    n_translations, n_rotations = (
        math.prod(len(axis) - 1 for axis in bins[kind].values())
        for kind in ("translation", "rotation")
    )
    ends = [begin, begin + n_translations, begin + n_translations + n_rotations]
    return [(ends[0], ends[1]), (ends[1], ends[2]), (ends[2], ends[2] + 2)]


def decode_action(
    ids: list[int], places: list[tuple[int, int]], bins: dict[str, dict[str, list[float]]]
) -> list[float]:
    """Return the seven numbers that three tokens encode."""
    numbers = [token - start for token, (start, _) in zip(ids, places, strict=True)]
    middles = []
    for number, kind, names in zip(
        numbers,
        ("translation", "rotation"),
        (("theta", "phi", "r"), ("roll", "pitch", "yaw")),
        strict=False,
    ):
        left, values = number, {}
        for name in reversed(names):
            axis = bins[kind][f"{name}_bins"]
            left, at = divmod(left, len(axis) - 1)
            values[name] = 0.5 * (axis[at] + axis[at + 1])
        middles += [values[name] for name in names]
    theta, phi, r, *rotation = middles
    xyz = (
        r * math.sin(theta) * math.cos(phi),
        r * math.sin(theta) * math.sin(phi),
        r * math.cos(theta),
    )
    return [*(min(max(x, -1.0), 1.0) for x in xyz), *rotation, float(numbers[2] != 0)]


if __name__ == "__main__":
    main()
