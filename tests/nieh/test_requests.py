"""What models are shown and told on the bundled set, held to what it was when the set was made."""

import json

import pytest

from infthor_eval.formats.pictures.video import Video
from infthor_eval.nieh.samples import find_samples
from infthor_eval.runs import Catalog
from infthor_eval.storage.digests import digest

# By task: samples asked, samples skipped, digest of all requests (frames by name). Contexts that a
# CLIP model or a memory chooses are not among them.
SIZES = ("16k", "32k", "64k", "128k", "256k", "512k", "1m")  # more than the trajectories have
WHOLE = ("nieh_full", "nieh_mini_full", *(f"nieh_truncate_head_{size}" for size in SIZES))
# Frames in the words of the logs; the tasks of videos ask as the others do.
LOGGED = [f"nieh_published_{name}" for name in ("full", "last_32k", "last_64k")]
EXPECTED = {
    **{f"nieh_haystack_{size}": (0, 554, "7ebb3c7c2a87b1a2f8a7ed729ecb040d") for size in SIZES},
    "nieh_haystack_8k": (295, 259, "96107f1f32fbfa65cf999a6c467a27b6"),
    "nieh_interleaved": (126, 0, "5f7ba3dddfc1192af552637dccaf3305"),
    "nieh_interleaved_plans": (126, 0, "297fe3b01ff5599bb2a3a3646e3c2040"),
    "nieh_text_state": (126, 0, "eb4afbd2d1bf629a9d5ecace6d242a07"),
    **dict.fromkeys(WHOLE, (126, 0, "72f46fa87b48716a958d84405a52472d")),
    "nieh_truncate_head_8k": (126, 0, "6796bfb3c4eef4f985d0d74c5d692b0b"),
    "nieh_video": (126, 0, "948adf790eed5b798568196d432da11b"),
    "nieh_video_2fps": (126, 0, "f003e96961d27af5833045e23e96884b"),
    **dict.fromkeys(("nieh_gt", "nieh_mini_gt"), (126, 0, "35f680f929194e8e4c75e8be0eff8e2d")),
    **dict.fromkeys(LOGGED, (126, 0, "9fe1a4c37e7b703b086d524c0cf2ffee")),
    "nieh_published_video_1fps": (126, 0, "948adf790eed5b798568196d432da11b"),
    "nieh_published_video_2fps": (126, 0, "f003e96961d27af5833045e23e96884b"),
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
        "nieh_mini_twins",
        "nieh_twins",  # has no set here that it could be asked of
    }
    ours = {name for name, task in Catalog.find_packaged().tasks.items() if task.suite == "nieh"}
    assert set(EXPECTED) == ours - by_others
