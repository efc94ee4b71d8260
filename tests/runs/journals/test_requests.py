"""Requests in a journal: each distinct one once, its texts and frames in their order."""

from itertools import pairwise
from pathlib import Path

import msgspec
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video
from infthor_eval.runs import StoredFrames, StoredRequest, keep_request
from infthor_eval.runs.journals.requests import stretches
from infthor_eval.runs.work.executor import UnrecordedSession

TEXTS = st.text(max_size=6)


def frames(folder: Path, n: int) -> list[FrameRef]:
    paths = [folder / f"{at}.png" for at in range(n)]
    for at, path in enumerate(paths):
        Image.new("RGB", (2, 2), (at, 0, 0)).save(path)
    return list(map(FrameRef, paths))


@given(st.lists(TEXTS), TEXTS, TEXTS, st.text(min_size=1, max_size=6))
def test_the_text_is_what_was_sent(context, before, after, question):
    text = f"{before}{question}{after}"
    stored = StoredRequest.of(context, text, question)
    assert stored.text(question, str) == "".join([*context, text])
    assert msgspec.json.decode(msgspec.json.encode(stored), type=StoredRequest) == stored


def test_a_question_that_the_text_lacks_is_not_put_into_it():
    stored = StoredRequest.of((), "Say where the cup is.", "Where is the mug?")
    assert stored.text("Where is the mug?", str) == "Say where the cup is."


def test_frames_are_stretches_with_a_digest_of_their_contents(tmp_path):
    first, second, third = frames(tmp_path, 3)
    places = {first: 4, second: 5, third: 9}

    def store(*context):
        return StoredRequest.of(context, "?", "?", lambda few: [places[it] for it in few], shown=())

    own = store(first, second, third, "then", Video((second,), 1.0)).parts
    assert [(it.what, it.places, it.n) for it in own if isinstance(it, StoredFrames)] == [
        ("frames", ((4, 5), (9, 9)), 3),
        ("video of 1 frames per second", ((5, 5),), 1),
    ]
    assert store(first, second).pixels != store(second, first).pixels
    history = store("a step", first, "a step", third)
    assert history.stored == ("a step", 4, "a step", 9, None)
    assert [(it.places, it.n) for it in history.parts if isinstance(it, StoredFrames)] == [
        (((4, 4),), 1),
        (((9, 9),), 1),
    ]


@given(st.sets(st.integers(0, 50)))
def test_stretches_have_every_place_once(places):
    found = stretches(sorted(places))
    assert [at for first, last in found for at in range(first, last + 1)] == sorted(places)
    assert all(last + 1 < first for (_, last), (first, _) in pairwise(found))


def test_a_request_is_kept_once():
    session = UnrecordedSession()
    names = {keep_request(StoredRequest((text, None)), session) for text in ("a", "a", "b")}
    assert len(names) == 2
    assert all(session.find_artifact(name, StoredRequest) is not None for name in names)
