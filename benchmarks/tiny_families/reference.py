"""Replies of transformers' own processor and `generate`, in a process of its own.

Many processors need torchvision, which is kept out of the environment: the caller puts it on the
path of this process. Reads a JSON object from the standard input and writes one as its last line:
each family's replies, the last of them on inverted frames, or one line of error. A reply has the
ids of its tokens, and by how much the logit of each is above that of the next likely one.
"""

import json
import sys
from typing import Any, cast

import torch
import transformers
from PIL import Image, ImageOps

_AUTO = cast(Any, transformers)  # whose loading functions are untyped


def main() -> None:
    """Answer the questions that the standard input has."""
    work = json.load(sys.stdin)
    answers: dict[str, Any] = {}
    for name, folder in work["folders"].items():
        try:
            answers[name] = _answer(folder, work["frames"], work["questions"], work["new_tokens"])
        except Exception as error:  # noqa: BLE001 - one bad family never stops the others
            answers[name] = " ".join(f"{type(error).__name__}: {error}".split())
    print(json.dumps(answers))


def _answer(
    folder: str, paths: list[str], questions: list[str], new_tokens: int
) -> list[dict[str, list[Any]]]:
    processor = _AUTO.AutoProcessor.from_pretrained(folder)
    # As in the project: torchvision's resize gives other pixels.
    processor.image_processor = _AUTO.AutoImageProcessor.from_pretrained(folder, backend="pil")
    model = _AUTO.AutoModelForImageTextToText.from_pretrained(folder).eval()
    frames: list[Image.Image] = [Image.open(path) for path in paths]
    asked = [(frames, question) for question in questions]
    asked.append(([ImageOps.invert(frame) for frame in frames], questions[0]))
    return [_reply(processor, model, *each, new_tokens) for each in asked]


def _reply(
    processor: Any, model: Any, frames: list[Any], question: str, new_tokens: int
) -> dict[str, list[Any]]:
    content = [*({"type": "image"} for _ in frames), {"type": "text", "text": question}]
    text = processor.apply_chat_template(
        [{"role": "user", "content": content}], add_generation_prompt=True
    )
    begin = processor.tokenizer.bos_token
    inputs = processor(
        text=[text],
        images=frames,
        add_special_tokens=begin is None or not text.startswith(begin),
        return_tensors="pt",
    )
    inputs.pop("labels", None)  # PaliGemma's, for training
    output = model.generate(
        **inputs.to(model.device, model.dtype),
        do_sample=False,
        max_new_tokens=new_tokens,
        return_dict_in_generate=True,
        output_logits=True,
    )
    best = torch.cat(output.logits).float().topk(2).values
    margins = (best[:, 0] - best[:, 1]).tolist()
    tokens: list[int] = output.sequences[0, inputs["input_ids"].shape[1] :].tolist()
    if tokens and tokens[-1] in model.generation_config.eos_token_id:
        tokens = tokens[:-1]
    return {"tokens": tokens, "margins": margins}


if __name__ == "__main__":
    main()
