"""What models are shown and told on the bundled set, held to what it was before the driver was our own."""

import json

import pytest

from infthor_eval.formats.digests import digest
from infthor_eval.nieh.notes import Notes
from infthor_eval.nieh.samples import find_samples
from infthor_eval.runs import Catalog

# By task: samples asked, samples skipped, digest of all requests (frames by name). Contexts that a CLIP model chooses
# frames for are not among them.
EXPECTED = {
    "nieh_haystack_128k": (0, 690, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_16k": (55, 635, "901dec002efe54828b10d452cb655771"),
    "nieh_haystack_1m": (0, 690, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_256k": (0, 690, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_32k": (0, 690, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_512k": (0, 690, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_64k": (0, 690, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_8k": (400, 290, "ea581bda08520ae6780b486b9d7f110c"),
    "nieh_interleaved": (150, 0, "34d31a06dc5cbc051d69b800185145d9"),
    "nieh_interleaved_plans": (150, 0, "6a8b35b9b802b47e4109c9ece7dd5d7a"),
    "nieh_memory_notes": (150, 0, "f0a5adb67f8f4ed996aa186a3efad23b"),
    "nieh_text_state": (150, 0, "143a276ea466e31e6467c0ab41f66ea9"),
    "nieh_truncate_head_128k": (150, 0, "26102c18ede530fd7e598b9badbc950f"),
    "nieh_truncate_head_16k": (150, 0, "032dae683eef8755e99569cbe177526c"),
    "nieh_truncate_head_1m": (150, 0, "26102c18ede530fd7e598b9badbc950f"),
    "nieh_truncate_head_256k": (150, 0, "26102c18ede530fd7e598b9badbc950f"),
    "nieh_truncate_head_32k": (150, 0, "26102c18ede530fd7e598b9badbc950f"),
    "nieh_truncate_head_512k": (150, 0, "26102c18ede530fd7e598b9badbc950f"),
    "nieh_truncate_head_64k": (150, 0, "26102c18ede530fd7e598b9badbc950f"),
    "nieh_truncate_head_8k": (150, 0, "0cf3f4482316d62a17efab6c0319e711"),
    "nieh_video": (150, 0, "978d531e081b37e0d3e480a4e5fe09df"),
    "nieh_full": (150, 0, "26102c18ede530fd7e598b9badbc950f"),
    "nieh_gt": (150, 0, "a29e908f8d70e8090436dc4b224b409a"),
    "nieh_mini_full": (150, 0, "26102c18ede530fd7e598b9badbc950f"),
    "nieh_mini_gt": (150, 0, "a29e908f8d70e8090436dc4b224b409a"),
}


def as_text(part):
    if isinstance(part, str):
        return part
    if isinstance(part, Notes):
        return f"notes {part.traj_id} {part.taking.window} {part.taking.max_new_tokens} {len(part.frames)}"
    return f"{part.path.parent.parent.name}/{part.path.name}"


@pytest.mark.parametrize("task", EXPECTED)
def test_requests_are_what_they_were(task):
    settings = Catalog.packaged().tasks[task].settings["dataset_kwargs"]
    found = find_samples({"bundled": "nieh_mini", "tokens_per_frame": 121, "seed": 0, **settings})
    rows = []
    for sample in found.samples:
        context, text = found.request(sample)
        rows.append([sample.question.id, sample.variant, *map(as_text, context), text])
    requests = digest(json.dumps(rows, ensure_ascii=False))
    assert (len(found.samples), len(found.skipped), requests) == EXPECTED[task]


def test_every_task_is_among_them():
    chosen_by_clip = {"nieh_clip_retrieval", "nieh_memory_frames"}
    assert set(EXPECTED) == set(Catalog.packaged().tasks) - chosen_by_clip
