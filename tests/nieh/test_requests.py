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
    "nieh_haystack_128k": (0, 604, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_16k": (0, 604, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_1m": (0, 604, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_256k": (0, 604, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_32k": (0, 604, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_512k": (0, 604, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_64k": (0, 604, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_8k": (353, 251, "3816ea4d64686d88bee054405dc69c82"),
    "nieh_interleaved": (136, 0, "a75f9bb16abeee2594f071f955724931"),
    "nieh_interleaved_plans": (136, 0, "ace9cd8e82ce8ff7146f271e779c722e"),
    "nieh_text_state": (136, 0, "30bedfb221b91e4510135df914499bcf"),
    "nieh_truncate_head_128k": (136, 0, "a346ad756b842d6ff69706eb52d165f1"),
    "nieh_truncate_head_16k": (136, 0, "a346ad756b842d6ff69706eb52d165f1"),
    "nieh_truncate_head_1m": (136, 0, "a346ad756b842d6ff69706eb52d165f1"),
    "nieh_truncate_head_256k": (136, 0, "a346ad756b842d6ff69706eb52d165f1"),
    "nieh_truncate_head_32k": (136, 0, "a346ad756b842d6ff69706eb52d165f1"),
    "nieh_truncate_head_512k": (136, 0, "a346ad756b842d6ff69706eb52d165f1"),
    "nieh_truncate_head_64k": (136, 0, "a346ad756b842d6ff69706eb52d165f1"),
    "nieh_truncate_head_8k": (136, 0, "13c1b5998551b95249d041078aa9fd7c"),
    "nieh_video": (136, 0, "361b5376933137bbcb2265f43e59c99a"),
    "nieh_video_2fps": (136, 0, "32b9fe1b6aee0c429824d3c4bc6b65a1"),
    "nieh_full": (136, 0, "a346ad756b842d6ff69706eb52d165f1"),
    "nieh_gt": (136, 0, "fd4fa5eb2ee294856b2faa15d3f4472f"),
    "nieh_mini_full": (136, 0, "a346ad756b842d6ff69706eb52d165f1"),
    "nieh_mini_gt": (136, 0, "fd4fa5eb2ee294856b2faa15d3f4472f"),
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
