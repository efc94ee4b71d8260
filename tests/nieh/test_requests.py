"""What models are shown and told on the bundled set, held to what it was when the set was made."""

import json

import pytest

from infthor_eval.formats.video import Video
from infthor_eval.nieh.samples import find_samples
from infthor_eval.runs import Catalog
from infthor_eval.storage.digests import digest

# By task: samples asked, samples skipped, digest of all requests (frames by name). Contexts that a
# CLIP model or a memory chooses are not among them.
EXPECTED = {
    "nieh_haystack_128k": (0, 601, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_16k": (0, 601, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_1m": (0, 601, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_256k": (0, 601, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_32k": (0, 601, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_512k": (0, 601, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_64k": (0, 601, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_8k": (339, 262, "d18c987b184b08c4769267456cb35a2b"),
    "nieh_interleaved": (133, 0, "af8ec36753a5cb1151565ec97ac98f2d"),
    "nieh_interleaved_plans": (133, 0, "cb4e48b7263bf7af710b469415dad7a7"),
    "nieh_text_state": (133, 0, "f02af3c793a064a5ba766b937ae5ca98"),
    "nieh_truncate_head_128k": (133, 0, "66b49f4261fd95e9741383d18b1286f0"),
    "nieh_truncate_head_16k": (133, 0, "66b49f4261fd95e9741383d18b1286f0"),
    "nieh_truncate_head_1m": (133, 0, "66b49f4261fd95e9741383d18b1286f0"),
    "nieh_truncate_head_256k": (133, 0, "66b49f4261fd95e9741383d18b1286f0"),
    "nieh_truncate_head_32k": (133, 0, "66b49f4261fd95e9741383d18b1286f0"),
    "nieh_truncate_head_512k": (133, 0, "66b49f4261fd95e9741383d18b1286f0"),
    "nieh_truncate_head_64k": (133, 0, "66b49f4261fd95e9741383d18b1286f0"),
    "nieh_truncate_head_8k": (133, 0, "d30c94c338af27f14f9fea2af0c07d14"),
    "nieh_video": (133, 0, "37561caab6c98babc397cc7d9a7ac5a7"),
    "nieh_video_2fps": (133, 0, "057f0ca43e5ffd2e6c3d9d9a52ed6b77"),
    "nieh_full": (133, 0, "66b49f4261fd95e9741383d18b1286f0"),
    "nieh_gt": (133, 0, "6a420d6cfe8b63ad8e6d3268a332988d"),
    # Frames in the words of the logs; the tasks of videos ask as those above.
    "nieh_published_full": (133, 0, "4aacdc6d7fe8cc93558bef6c2a45a170"),
    "nieh_published_last_32k": (133, 0, "4aacdc6d7fe8cc93558bef6c2a45a170"),
    "nieh_published_last_64k": (133, 0, "4aacdc6d7fe8cc93558bef6c2a45a170"),
    "nieh_published_video_1fps": (133, 0, "37561caab6c98babc397cc7d9a7ac5a7"),
    "nieh_published_video_2fps": (133, 0, "057f0ca43e5ffd2e6c3d9d9a52ed6b77"),
    "nieh_mini_full": (133, 0, "66b49f4261fd95e9741383d18b1286f0"),
    "nieh_mini_gt": (133, 0, "6a420d6cfe8b63ad8e6d3268a332988d"),
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
    task_samples = find_samples(
        {"bundled": "nieh_mini", "tokens_per_frame": 121, "seed": 0, **settings}
    )
    rows = []
    for sample in task_samples.samples:
        context, text = task_samples.request(sample)
        rows.append([sample.question.id, sample.variant, *map(as_text, context), text])
    requests = digest(json.dumps(rows, ensure_ascii=False))
    assert (len(task_samples.samples), len(task_samples.skipped), requests) == EXPECTED[task]


def test_every_task_is_among_them():
    retrieved = {"nieh_clip_retrieval", "nieh_published_clip_10", "nieh_published_clip_20"}
    by_others = retrieved | {
        "nieh_memory",
        "nieh_memory_frames",
        "nieh_memory_notes",
        "nieh_mini_memory",
    }
    ours = {name for name, task in Catalog.find_packaged().tasks.items() if task.suite == "nieh"}
    assert set(EXPECTED) == ours - by_others
