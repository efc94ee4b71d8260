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
    **{f"nieh_haystack_{size}": (0, 559, "7ebb3c7c2a87b1a2f8a7ed729ecb040d") for size in SIZES},
    "nieh_haystack_8k": (292, 267, "8e8c83c081edf27e69501abb57f7ff7b"),
    "nieh_interleaved": (127, 0, "72830d7abd851e9cb542a075681fb76d"),
    "nieh_interleaved_plans": (127, 0, "7ccfaa50604e0a9303e44667f78ed662"),
    "nieh_text_state": (127, 0, "6cbd18c96d09425dfe15fc873a5c2e5d"),
    **dict.fromkeys(WHOLE, (127, 0, "f1e2774feda3022249a9976bbb1aae4e")),
    "nieh_truncate_head_8k": (127, 0, "cda4d47a89acbc82f55da38ad4aa1a0c"),
    "nieh_video": (127, 0, "706ee22dc1038b585f00d28966614176"),
    "nieh_video_2fps": (127, 0, "0289c90d8ff82a005bc20b4b74f8e9e6"),
    **dict.fromkeys(("nieh_gt", "nieh_mini_gt"), (127, 0, "500e56f42ee521af15bb81deca13959e")),
    **dict.fromkeys(LOGGED, (127, 0, "654cd61246c6c418bcc1a644236b54e0")),
    "nieh_published_video_1fps": (127, 0, "706ee22dc1038b585f00d28966614176"),
    "nieh_published_video_2fps": (127, 0, "0289c90d8ff82a005bc20b4b74f8e9e6"),
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
        "nieh_mini_arm_twins",
        "nieh_mini_long",
        "nieh_mini_memory",
        "nieh_mini_twins",
        "nieh_moments",
        "nieh_twins",  # has no set here that it could be asked of
    }
    ours = {name for name, task in Catalog.find_packaged().tasks.items() if task.suite == "nieh"}
    assert set(EXPECTED) == ours - by_others
