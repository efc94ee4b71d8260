"""What models are shown and told on the bundled set, held to what it was when the set was made."""

import json

import pytest

from infthor_eval.formats.digests import digest
from infthor_eval.formats.video import Video
from infthor_eval.nieh.samples import find_samples
from infthor_eval.runs import Catalog

# By task: samples asked, samples skipped, digest of all requests (frames by name). Contexts that a CLIP model or a
# memory chooses are not among them.
EXPECTED = {
    "nieh_haystack_128k": (0, 572, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_16k": (0, 572, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_1m": (0, 572, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_256k": (0, 572, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_32k": (0, 572, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_512k": (0, 572, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_64k": (0, 572, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_8k": (304, 268, "ea58b04c9c3e0b584224cc44bd164aab"),
    "nieh_interleaved": (132, 0, "4033c4841faa12614d89c3e193d34bc2"),
    "nieh_interleaved_plans": (132, 0, "639dc2806e5153c963c0c909e706ff50"),
    "nieh_text_state": (132, 0, "35c575c500a7d79a1decd0dd531b5027"),
    "nieh_truncate_head_128k": (132, 0, "6014c19eeacd3a6df2eb77a0f25f8c05"),
    "nieh_truncate_head_16k": (132, 0, "6014c19eeacd3a6df2eb77a0f25f8c05"),
    "nieh_truncate_head_1m": (132, 0, "6014c19eeacd3a6df2eb77a0f25f8c05"),
    "nieh_truncate_head_256k": (132, 0, "6014c19eeacd3a6df2eb77a0f25f8c05"),
    "nieh_truncate_head_32k": (132, 0, "6014c19eeacd3a6df2eb77a0f25f8c05"),
    "nieh_truncate_head_512k": (132, 0, "6014c19eeacd3a6df2eb77a0f25f8c05"),
    "nieh_truncate_head_64k": (132, 0, "6014c19eeacd3a6df2eb77a0f25f8c05"),
    "nieh_truncate_head_8k": (132, 0, "1f706435c8431362ec39ca27120f9fcc"),
    "nieh_video": (132, 0, "fa27b13b8a27674b01492099c2defcc6"),
    "nieh_video_2fps": (132, 0, "a22665f485d80df2ae8bb959c419e1f3"),
    "nieh_full": (132, 0, "6014c19eeacd3a6df2eb77a0f25f8c05"),
    "nieh_gt": (132, 0, "8d9f5d021b6aba378ba3cf64acf42003"),
    "nieh_mini_full": (132, 0, "6014c19eeacd3a6df2eb77a0f25f8c05"),
    "nieh_mini_gt": (132, 0, "8d9f5d021b6aba378ba3cf64acf42003"),
}


def as_text(part):
    if isinstance(part, str):
        return part
    if isinstance(part, Video):
        return f"video of {part.fps:.4f} fps {' '.join(map(as_text, part.frames))}"
    return f"{part.path.parent.parent.name}/{part.path.name}"


@pytest.mark.parametrize("task", EXPECTED)
def test_requests_are_what_they_were(task):
    settings = Catalog.find_packaged().tasks[task].settings["dataset_kwargs"]
    found = find_samples({"bundled": "nieh_mini", "tokens_per_frame": 121, "seed": 0, **settings})
    rows = []
    for sample in found.samples:
        context, text = found.request(sample)
        rows.append([sample.question.id, sample.variant, *map(as_text, context), text])
    requests = digest(json.dumps(rows, ensure_ascii=False))
    assert (len(found.samples), len(found.skipped), requests) == EXPECTED[task]


def test_every_task_is_among_them():
    by_others = {"nieh_clip_retrieval", "nieh_memory", "nieh_memory_frames", "nieh_memory_notes", "nieh_mini_memory"}
    ours = {name for name, task in Catalog.find_packaged().tasks.items() if task.suite == "nieh"}
    assert set(EXPECTED) == ours - by_others
