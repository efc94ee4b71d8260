import json

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.own_films import SampledFilm

_SIDE = 16  # of a white square, which frame n has n squares from the left


def write_film(path, n_frames, fps):
    """Write a film whose frames tell their number."""
    film = cv2.VideoWriter(
        str(path), cv2.VideoWriter.fourcc(*"mp4v"), fps, (_SIDE * n_frames, _SIDE)
    )
    for number in range(n_frames):
        pixels = np.zeros((_SIDE, _SIDE * n_frames, 3), np.uint8)
        pixels[:, _SIDE * number : _SIDE * (number + 1)] = 255
        film.write(pixels)
    film.release()


def numbers(frames):
    return [
        int(np.asarray(frame.load()).mean((0, 2))[_SIDE // 2 :: _SIDE].argmax()) for frame in frames
    ]


@pytest.fixture
def make_set(tmp_path):
    """Return a function that writes `walk.mp4` (5 s, 10 fps), a folder `room` and the lines."""

    def write(*lines):
        write_film(tmp_path / "walk.mp4", 50, 10.0)
        (tmp_path / "room").mkdir()
        for name in "123":
            Image.new("RGB", (28, 28)).save(tmp_path / f"room/{name}.png")
        if lines:
            (tmp_path / "questions.csv").write_text("\n".join(lines) + "\n")
        return tmp_path

    return write


def test_seconds_are_those_of_the_frames_of_the_film(make_set):
    header = "trajectory,question,answer,clue_seconds,moment_seconds"
    rows = ["walk,a,x,0,", "walk,b,x,4.9,", 'walk,c,x,"2.4, 0.1-3.7",', "walk,d,x,,2.4"]
    data = NiehSet(make_set(header, *rows))
    # 50 frames at 1 fps: 4 of them (an even number), of which the last one is the film's.
    assert numbers(data.frames("walk")) == [0, 16, 33, 49]
    a, b, c, d = data.questions
    assert [numbers(data.clue_frames(row)) for row in (a, b)] == [[0], [49]]
    assert c.clues == (1, 2), "2.4 s is nearer to frame 16 than to 33; a range has all in it"
    assert (d.moment, d.clues) == (1, (0, 1)), "without clues all up to the moment are"
    assert numbers(data.frames_until(d)) == [0, 16]


@given(
    n=st.integers(1, 40),
    gap=st.floats(0.1, 3),
    spans=st.lists(st.tuples(st.floats(0, 9), st.floats(0, 3)), min_size=1, max_size=3),
)
def test_a_range_has_all_its_frames_or_the_nearest(n, gap, spans):
    film = SampledFilm(None, [at * gap for at in range(n)], max(12.0, n * gap))
    for first, length in spans:
        start, end = round(first, 3), round(first + length, 3)
        places = film.frames_at(f"{start:.3f}-{end:.3f}")
        within = tuple(at for at, time in enumerate(film.times) if start <= time <= end)
        assert within == places if within else len(places) == 1
        # A clue that ends at the moment is never after the moment's frame.
        (moment,) = film.frames_at(f"{end:.3f}")
        assert max(places) <= moment
        gaps = [abs(time - end) for time in film.times]
        assert gaps[moment] == min(gaps)
    cell = ", ".join(f"{start:.3f}" for start, _ in spans)
    places = film.frames_at(cell)
    assert len(set(places)) == len(places) <= len(spans)


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        ("walk,q,a,,abc,,", "clue_seconds: 'abc' is no number of seconds; write 12.5 or 12-14"),
        ("walk,q,a,,-3,,", "clue_seconds: '-3' is no number of seconds"),
        ("walk,q,a,,4-2,,", "clue_seconds: '4-2' ends before it starts"),
        ("walk,q,a,,90,,", "clue_seconds: '90' is after the end of the film; write seconds from 0"),
        ("walk,q,a,1,1,,", "clue_seconds: clue_frames is filled as well"),
        ("walk,q,a,7,,,", "clue_frames has an entry that is no frame"),
        ("room,q,a,,1,,", "clue_seconds: frames in a folder have no time; write clue_frames"),
        ("walk,q,a,,,x,", "moment has an entry that is no frame of the trajectory ('x')"),
        ("walk,q,a,,,,0-5", "moment_seconds: is 4 frames; write one"),
        ("walk,q,a,3,,1,", "clue_frames: frame 3 is after the question's moment, frame 1"),
        ("home,q,a,,,,", "trajectory is not the name of a folder of frames or a film; it is one"),
        ('walk,q,"[""a""",,,,', "answer: is no JSON list of texts and numbers; write ["),
        ("walk,q,[],,,,", "answer: is no JSON list"),
        ("walk,q,[true],,,,", "answer: is no JSON list"),
        ("walk,q,a | ,,,,", "answer: has an empty part; write"),
        ('walk,q,"[""""]",,,,', "answer: has an empty part"),
        ("walk,q,[1e300],,,,", "answer: has a number that no reply can match"),
    ],
)
def test_a_row_that_cannot_be_used_says_where_and_what_to_write(make_set, row, reason):
    header = "trajectory,question,answer,clue_frames,clue_seconds,moment,moment_seconds"
    data = NiehSet(make_set(header, "walk,good,a,,,,", row))
    (skipped,) = data.skipped
    assert skipped.reason.startswith(f"questions.csv, line 3: {reason}")
    assert len(data.questions) == 1


def test_a_film_that_cannot_be_decoded_does_not_stop_others(make_set):
    folder = make_set("trajectory,question,answer", "walk,q,a", "bad,q,a", "bad,r,a", "room,q,a")
    (folder / "bad.webm").write_bytes(b"no film")
    data = NiehSet(folder)
    assert [row.traj_id for row in data.questions] == ["walk", "room"]
    reason = "bad.webm: not a video that OpenCV can decode; write the film again, as MP4 with H.264"
    assert [row.reason for row in data.skipped] == [
        f"questions.csv, line {line}: {reason}" for line in (3, 4)
    ]
    assert data.fingerprint


@pytest.mark.parametrize("name", ["room.mp4", "walk.avi"])
def test_two_trajectories_of_one_name_are_refused(make_set, name):
    folder = make_set("trajectory,question,answer", "walk,q,a")
    write_film(folder / name, 4, 1.0)
    with pytest.raises(DataError, match="is a trajectory of that name as well; rename"):
        NiehSet(folder)


# -- annotations in JSON

_MAPPING = "entries: data.queries\nquestion: q.text\nanswer: reply\ntrajectory: uid\n"
_SECONDS = "clue_seconds: window\nmoment_seconds: at\n"
_GOOD = {"q": {"text": "where?"}, "reply": "table", "uid": "walk", "window": [1, 2], "at": 4.9}


@pytest.fixture
def make_annotations(make_set):
    def write(mapping, entries):
        folder = make_set()
        (folder / "mapping.yaml").write_text(mapping)
        (folder / "annotations.json").write_text(json.dumps({"data": {"queries": entries}}))
        return folder

    return write


def test_annotations_are_read_by_their_mapping(make_annotations):
    more = [
        _GOOD | {"reply": ["a mug | plate", 2], "window": 0.2},
        _GOOD | {"reply": "=[1] | 2", "window": [[0, 2], 4.9, [3, 3.4]]},
    ]
    folder = make_annotations(_MAPPING + _SECONDS, [_GOOD, *more])
    first, second, third = NiehSet(folder).questions
    assert (first.text, first.traj_id, first.answers) == ("where?", "walk", ("table",))
    assert (first.clues, first.moment) == ((1,), 3)
    assert (second.answers, second.clues) == (("a mug | plate", 2), (0,))
    assert (third.answers, third.clues) == (("=[1] | 2",), (0, 1, 3, 2))
    before = NiehSet(folder).fingerprint
    (folder / "mapping.yaml").write_text(_MAPPING)
    assert NiehSet(folder).fingerprint != before, "it says what the questions are"


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"q": {}}, "question: there is no 'q.text'; add it, or correct the path in mapping.yaml"),
        ({"q": {"text": []}}, "question: is no text; write one, or correct the path"),
        ({"window": ["1", 2]}, "clue_seconds: '1' is no number of seconds; write 12.5, [12, 14]"),
        ({"window": [[1, 2, 3], 4]}, "clue_seconds: [1, 2, 3] is no number of seconds"),
        ({"at": None}, "moment_seconds: None is no number of seconds"),
        ({"at": 1e9}, "moment_seconds: '1000000000.000000' is after the end of the film"),
        ({"reply": None}, "answer: is no JSON list of texts and numbers"),
        ({"uid": "home"}, "trajectory is not the name of a folder"),
    ],
)
def test_an_entry_that_cannot_be_used_is_named(make_annotations, change, reason):
    data = NiehSet(make_annotations(_MAPPING + _SECONDS, [_GOOD, _GOOD | change]))
    (skipped,) = data.skipped
    assert skipped.reason.startswith(f"annotations.json, entry 2: {reason}")


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        ("- question", "mapping.yaml: has no lines of names and paths; a line is `question: PATH`"),
        (_MAPPING + "clues: a", "mapping.yaml: 'clues' is not known; a line is"),
        (_MAPPING + "clue_seconds: [a]", "clue_seconds is no path, as in clip.uid"),
        ("question: q.text", "does not say where answer is"),
        ("question: q.text\nanswer: reply", "annotations.json: its top is no list; write `entries"),
        (_MAPPING.replace("data.q", "data.Q"), "entries: there is no 'data.Queries'; add it"),
        (_MAPPING.replace(".queries", ""), "data is no list; write `entries: PATH` of one"),
    ],
)
def test_a_mapping_that_cannot_be_used_is_refused_in_one_line(make_annotations, mapping, message):
    with pytest.raises(DataError) as error:
        NiehSet(make_annotations(mapping, [_GOOD]))
    assert message in str(error.value) and "\n" not in str(error.value)
