"""Private sets: what is published says nothing of an answer, nor of the secret."""

import hashlib
from pathlib import Path

import msgspec
import pytest
from PIL import Image

from infthor_board.private_sets import publish, read_secret
from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import WITHHELD
from infthor_eval.formats.replies.answer_key import read_key
from infthor_eval.formats.set_info import claim_for_simulator
from tests.helpers.twin_sets import write_twin_set

SECRET = "5eed" * 16


@pytest.fixture
def secret(tmp_path):
    path = tmp_path / "secret.txt"
    path.write_text(SECRET + "\n")
    return read_secret(path)


@pytest.fixture
def private(tmp_path) -> NiehSet:
    root = tmp_path / "out" / "key"
    root.mkdir(parents=True)
    claim_for_simulator(root, "embedded")
    return NiehSet(write_twin_set(root, range(1, 9)))


@pytest.fixture
def public(private, secret, tmp_path) -> Path:
    return publish(private, secret, tmp_path / "out" / "public")


def files(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.rglob("*")) if path.is_file()]


def test_it_has_every_question_and_every_frame_and_no_answer(private, public):
    published = NiehSet(public)
    assert len(published.questions) == len(private.questions)
    assert {question.answers for question in published.questions} == {(WITHHELD,)}
    assert not any(it.pair or it.fact or it.base or it.absence for it in published.questions)
    key = read_key(private.directory)
    for question in published.questions:
        gold = key.question(question.id)
        shown = [frame.path.read_bytes() for frame in published.frames(question.traj_id)]
        assert shown == [frame.path.read_bytes() for frame in private.frames(gold.traj_id)]
        assert (question.text, question.clues) == (gold.text, tuple(sorted(gold.clues)))


def test_the_questions_of_a_pair_differ_in_the_name_of_their_world_alone(private, public):
    key = read_key(private.directory)
    pairs = {}
    for question in NiehSet(public).questions:
        pairs.setdefault(key.question(question.id).pair, []).append(question)
    for first, second in pairs.values():
        assert first.traj_id != second.traj_id
        assert len(first.traj_id) == len(second.traj_id)
        for field in ("text", "clues", "answers", "question_type", "absence"):
            assert getattr(first, field) == getattr(second, field)


def test_worlds_differ_in_frames_alone(private, public):
    worlds = sorted((public / "metadata").iterdir())
    assert len({(world / "metadata.json").read_bytes() for world in worlds}) == 1
    assert {path.name for world in worlds for path in world.iterdir()} == {
        "frames.txt",
        "metadata.json",
    }
    assert len({len((world / "frames.txt").read_bytes()) for world in worlds}) == 1


def test_ids_are_not_made_of_answers(private, public):
    """Whoever tries all answers on a question's id learns nothing."""
    by_private = {question.id.partition("/")[2] for question in private.questions}
    published = NiehSet(public).questions
    assert not by_private & {question.id.partition("/")[2] for question in published}
    digests = {}
    for question in published:
        digest = question.id.partition("/")[2]
        digests.setdefault((question.text, question.clues), set()).add(digest)
    assert all(len(found) == 1 for found in digests.values())


def test_no_file_has_the_secret_or_anything_private(private, public):
    words = {SECRET, SECRET.upper(), bytes.fromhex(SECRET).decode("latin-1")}
    words |= {question.traj_id for question in private.questions}
    words |= {question.pair for question in private.questions}
    words |= {question.base for question in private.questions}
    words |= {pair.floor_plan for pair in private.twins.values()}
    words |= {"bowl", "sofa", "Mug|1", "Cup|1", "swap", "seed", "base of"}
    allowed = {"Where is the mug?", "Is the mug in the bowl?"}  # of the questions' own words
    for path in files(public):
        content = path.read_bytes().decode("latin-1")
        for text in allowed:
            content = content.replace(text, "")
        found = [word for word in words if word and word in content]
        assert not found, path
    names = " ".join(str(path.relative_to(public)) for path in files(public))
    assert not any(word and word in names for word in words)


def test_pictures_have_no_metadata_and_are_named_by_their_content(public):
    for path in (public / "frames").iterdir():
        with Image.open(path) as picture:
            assert picture.info == {}
        assert path.stem == hashlib.blake2b(path.read_bytes(), digest_size=16).hexdigest()


def test_order_and_names_follow_from_the_secret_alone(private, secret, tmp_path):
    questions = {}
    for name, text in (("a", SECRET), ("b", SECRET), ("c", "0" * 64)):
        (tmp_path / name).write_text(text)
        folder = publish(private, read_secret(tmp_path / name), tmp_path / f"public-{name}")
        questions[name] = [(it.traj_id, it.text) for it in NiehSet(folder).questions]
    assert questions["a"] == questions["b"]
    assert not {name for name, _ in questions["a"]} & {name for name, _ in questions["c"]}
    key = read_key(private.directory)
    order = [key.question(it.id).pair for it in NiehSet(tmp_path / "public-c").questions]
    assert order != sorted(order)


def test_all_files_have_one_time(public):
    paths = [public, *public.rglob("*")]
    assert {path.stat().st_mtime for path in paths} == {946_684_800}


def test_the_key_is_not_in_the_public_part(public):
    assert {path.name for path in public.iterdir()} == {
        "frames",
        "metadata",
        "qa_set_private.csv",
        "set.json",
    }
    assert set(msgspec.json.decode((public / "set.json").read_bytes())) == {
        "format",
        "simulator",
        "infthor_eval",
    }


@pytest.mark.parametrize("text", ["", "12345", "not hexadecimal" * 4, "ab" * 15, f"{SECRET}\n1"])
def test_what_can_be_tried_out_is_no_secret(tmp_path, text):
    (tmp_path / "secret.txt").write_text(text)
    with pytest.raises(DataError, match="32 to 256 hexadecimal digits"):
        read_secret(tmp_path / "secret.txt")


def test_a_secret_is_not_printed(secret):
    assert SECRET not in f"{secret!r} {secret}"


def test_the_public_part_is_not_written_twice(private, secret, public):
    with pytest.raises(DataError, match="is there already"):
        publish(private, secret, public)
