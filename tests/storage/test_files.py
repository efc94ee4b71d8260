import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.storage.digests import digest, digest_of_file
from infthor_eval.storage.files import file_name, write_atomically

_TEXTS = st.text(st.characters(codec=None))  # with lone surrogates


def test_a_file_replaces_the_earlier_one_when_it_is_whole(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with write_atomically(path) as partial:
        partial.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert [item.name for item in tmp_path.iterdir()] == ["a.txt"]


def test_an_error_leaves_the_earlier_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(OSError, match="full"), write_atomically(path) as partial:
        partial.write_text("ne")
        raise OSError("full")
    assert path.read_text() == "old"
    assert [item.name for item in tmp_path.iterdir()] == ["a.txt"]


def test_a_folder_appears_whole_and_leftovers_of_a_killed_process_are_gone(tmp_path):
    path = tmp_path / "set"
    leftover = tmp_path / ".set.partial"
    leftover.mkdir()
    (leftover / "stale").touch()
    with write_atomically(path) as partial:
        partial.mkdir()
        (partial / "fresh").touch()
    assert [item.name for item in path.iterdir()] == ["fresh"]
    assert not leftover.exists()


def test_a_file_has_the_digest_of_its_content(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"content")
    assert digest_of_file(path) == digest(b"content") == digest("content")
    assert len(digest("content", 4)) == 8


@given(_TEXTS, _TEXTS)
def test_a_name_of_any_text_is_one_part_of_a_path_and_its_own(one, other):
    name = file_name(one)
    assert name.isascii()
    assert not set(name) & set('/\\:*?"<>|\0\n')
    assert name == name.strip(". ")
    assert 0 < len(name) < 200
    assert (name == file_name(other)) == (one == other)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Qwen2.5-VL-3B-Instruct@main", None),
        ("a run", None),
        ("../../evil", "_.._evil-"),
        ("/etc/passwd", "_etc_passwd-"),
        ("..", "-"),
        ("C:\\x", "C_x-"),
        ("nul", "_nul-"),
        ("COM1.txt", "_COM1.txt-"),
        ("a. ", "a-"),
        ("x" * 300, "x" * 150 + "-"),
    ],
)
def test_names_that_are_safe_stay_and_others_say_what_they_were(text, expected):
    name = file_name(text)
    assert name == text if expected is None else name[:-8] == expected
