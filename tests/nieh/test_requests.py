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
    "nieh_haystack_128k": (0, 538, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_16k": (0, 538, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_1m": (0, 538, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_256k": (0, 538, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_32k": (0, 538, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_512k": (0, 538, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_64k": (0, 538, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_8k": (258, 280, "85ace57bc9cbd1e3e684acd1c6c7e80a"),
    "nieh_interleaved": (130, 0, "0cd92403ca331e5b69c9edf2feb8f683"),
    "nieh_interleaved_plans": (130, 0, "6940105eeaf7e8ee98881b314b787e0c"),
    "nieh_text_state": (130, 0, "70fbd7c6c5168860d16d5aa44b9601ce"),
    "nieh_truncate_head_128k": (130, 0, "f9d421a18f4ed4e6848a7f1358c08c36"),
    "nieh_truncate_head_16k": (130, 0, "f9d421a18f4ed4e6848a7f1358c08c36"),
    "nieh_truncate_head_1m": (130, 0, "f9d421a18f4ed4e6848a7f1358c08c36"),
    "nieh_truncate_head_256k": (130, 0, "f9d421a18f4ed4e6848a7f1358c08c36"),
    "nieh_truncate_head_32k": (130, 0, "f9d421a18f4ed4e6848a7f1358c08c36"),
    "nieh_truncate_head_512k": (130, 0, "f9d421a18f4ed4e6848a7f1358c08c36"),
    "nieh_truncate_head_64k": (130, 0, "f9d421a18f4ed4e6848a7f1358c08c36"),
    "nieh_truncate_head_8k": (130, 0, "e7a7d4ea8a3a7a93d39f088c3fdd9943"),
    "nieh_video": (130, 0, "425cac6ab054e916d4b1f8c8a2ab9a38"),
    "nieh_video_2fps": (130, 0, "d341703ef07a647a8d1deff376214dd3"),
    "nieh_full": (130, 0, "f9d421a18f4ed4e6848a7f1358c08c36"),
    "nieh_gt": (130, 0, "f7dedcc4cc2ad2ca899fdd99a0160442"),
    "nieh_mini_full": (130, 0, "f9d421a18f4ed4e6848a7f1358c08c36"),
    "nieh_mini_gt": (130, 0, "f7dedcc4cc2ad2ca899fdd99a0160442"),
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
