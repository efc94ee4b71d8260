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
    "nieh_haystack_128k": (0, 679, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_16k": (61, 618, "ad745fc631fda7a9397efb727a42fbc0"),
    "nieh_haystack_1m": (0, 679, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_256k": (0, 679, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_32k": (0, 679, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_512k": (0, 679, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_64k": (0, 679, "7ebb3c7c2a87b1a2f8a7ed729ecb040d"),
    "nieh_haystack_8k": (400, 279, "8d5f7a8b011595f0ab9f33bfa590099e"),
    "nieh_interleaved": (147, 0, "44df0f029b634401540af5abd2c77542"),
    "nieh_interleaved_plans": (147, 0, "9928243b774bb7338ab1bae2fdb881c2"),
    "nieh_text_state": (147, 0, "4c6677eb853621bf163d66feb549d6e5"),
    "nieh_truncate_head_128k": (147, 0, "6198fc625078c68495aa339150f419ab"),
    "nieh_truncate_head_16k": (147, 0, "6198fc625078c68495aa339150f419ab"),
    "nieh_truncate_head_1m": (147, 0, "6198fc625078c68495aa339150f419ab"),
    "nieh_truncate_head_256k": (147, 0, "6198fc625078c68495aa339150f419ab"),
    "nieh_truncate_head_32k": (147, 0, "6198fc625078c68495aa339150f419ab"),
    "nieh_truncate_head_512k": (147, 0, "6198fc625078c68495aa339150f419ab"),
    "nieh_truncate_head_64k": (147, 0, "6198fc625078c68495aa339150f419ab"),
    "nieh_truncate_head_8k": (147, 0, "267bf97366f280ca7e02a21094fdac18"),
    "nieh_video": (147, 0, "b2763a88bca0665f7a6f4560b2366413"),
    "nieh_video_2fps": (147, 0, "af83e1c428650e71511044526b25844c"),
    "nieh_full": (147, 0, "6198fc625078c68495aa339150f419ab"),
    "nieh_gt": (147, 0, "1b4f224e3c4ecf3c7daf44c222c1cbbc"),
    "nieh_mini_full": (147, 0, "6198fc625078c68495aa339150f419ab"),
    "nieh_mini_gt": (147, 0, "1b4f224e3c4ecf3c7daf44c222c1cbbc"),
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
