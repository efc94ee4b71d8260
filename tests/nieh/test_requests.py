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
    "nieh_haystack_128k": (0, 615, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_16k": (62, 553, "759ffd3eb8b0236a2a10fbfb08d38779"),
    "nieh_haystack_1m": (0, 615, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_256k": (0, 615, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_32k": (0, 615, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_512k": (0, 615, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_64k": (0, 615, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_8k": (368, 247, "0bb978a688929ba990cdc1338858f0cc"),
    "nieh_interleaved": (139, 0, "4fc0f79e2f73b20e1f27f57596b6e2b6"),
    "nieh_interleaved_plans": (139, 0, "ecd8fc918b174a632f5ae78d3d1ffc09"),
    "nieh_text_state": (139, 0, "5d15b3116076a1ebde8866ec18298580"),
    "nieh_truncate_head_128k": (139, 0, "e53a587281e0ba4c7f22d8edf9e195c4"),
    "nieh_truncate_head_16k": (139, 0, "e53a587281e0ba4c7f22d8edf9e195c4"),
    "nieh_truncate_head_1m": (139, 0, "e53a587281e0ba4c7f22d8edf9e195c4"),
    "nieh_truncate_head_256k": (139, 0, "e53a587281e0ba4c7f22d8edf9e195c4"),
    "nieh_truncate_head_32k": (139, 0, "e53a587281e0ba4c7f22d8edf9e195c4"),
    "nieh_truncate_head_512k": (139, 0, "e53a587281e0ba4c7f22d8edf9e195c4"),
    "nieh_truncate_head_64k": (139, 0, "e53a587281e0ba4c7f22d8edf9e195c4"),
    "nieh_truncate_head_8k": (139, 0, "e3c9b1b485b0ecd65ae590b504dc9d2c"),
    "nieh_video": (139, 0, "798b17cad6b4bc11412cafab5d591e49"),
    "nieh_video_2fps": (139, 0, "93f4feb705cfc1f05ba913272a00ee23"),
    "nieh_full": (139, 0, "e53a587281e0ba4c7f22d8edf9e195c4"),
    "nieh_gt": (139, 0, "e7b4b49ffc3e9c09555a1122231d2b72"),
    "nieh_mini_full": (139, 0, "e53a587281e0ba4c7f22d8edf9e195c4"),
    "nieh_mini_gt": (139, 0, "e7b4b49ffc3e9c09555a1122231d2b72"),
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
