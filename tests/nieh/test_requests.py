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
    "nieh_haystack_128k": (0, 586, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_16k": (0, 586, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_1m": (0, 586, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_256k": (0, 586, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_32k": (0, 586, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_512k": (0, 586, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_64k": (0, 586, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_8k": (335, 251, "ba9afd43f5d13930c14f038d537ba794"),
    "nieh_interleaved": (130, 0, "36e0231fa286fe1be6fd7a230dfcc693"),
    "nieh_interleaved_plans": (130, 0, "3752c709a13f47fc8093a96bb6719805"),
    "nieh_text_state": (130, 0, "0874d33cabd4f06f09f22867c8885bc6"),
    "nieh_truncate_head_128k": (130, 0, "7a00f6d40b4df451d2d52fac0baa2d3a"),
    "nieh_truncate_head_16k": (130, 0, "7a00f6d40b4df451d2d52fac0baa2d3a"),
    "nieh_truncate_head_1m": (130, 0, "7a00f6d40b4df451d2d52fac0baa2d3a"),
    "nieh_truncate_head_256k": (130, 0, "7a00f6d40b4df451d2d52fac0baa2d3a"),
    "nieh_truncate_head_32k": (130, 0, "7a00f6d40b4df451d2d52fac0baa2d3a"),
    "nieh_truncate_head_512k": (130, 0, "7a00f6d40b4df451d2d52fac0baa2d3a"),
    "nieh_truncate_head_64k": (130, 0, "7a00f6d40b4df451d2d52fac0baa2d3a"),
    "nieh_truncate_head_8k": (130, 0, "17593f41bf18f7b27980f211a83f1d49"),
    "nieh_video": (130, 0, "5d03bd55b22621e82db2b6678adbc8b2"),
    "nieh_video_2fps": (130, 0, "f62c1ef98f6fcf20242021df40ac17d7"),
    "nieh_full": (130, 0, "7a00f6d40b4df451d2d52fac0baa2d3a"),
    "nieh_gt": (130, 0, "cd0e2457a319bd08682e132433af3ef2"),
    # Frames in the words of the logs; the tasks of videos ask as those above.
    "nieh_published_full": (130, 0, "45cc54d6406620956487da1d9c705a37"),
    "nieh_published_last_32k": (130, 0, "45cc54d6406620956487da1d9c705a37"),
    "nieh_published_last_64k": (130, 0, "45cc54d6406620956487da1d9c705a37"),
    "nieh_published_video_1fps": (130, 0, "5d03bd55b22621e82db2b6678adbc8b2"),
    "nieh_published_video_2fps": (130, 0, "f62c1ef98f6fcf20242021df40ac17d7"),
    "nieh_mini_full": (130, 0, "7a00f6d40b4df451d2d52fac0baa2d3a"),
    "nieh_mini_gt": (130, 0, "cd0e2457a319bd08682e132433af3ef2"),
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
    retrieved = {"nieh_clip_retrieval", "nieh_published_clip_10", "nieh_published_clip_20"}
    by_others = retrieved | {"nieh_memory", "nieh_memory_frames", "nieh_memory_notes", "nieh_mini_memory"}
    ours = {name for name, task in Catalog.find_packaged().tasks.items() if task.suite == "nieh"}
    assert set(EXPECTED) == ours - by_others
