"""Members of inspect_ai's logs: which packings are read, and of what length."""

import json
import struct
import tracemalloc
import zipfile

import pyarrow
import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.replies.logs import read_reply_log

_HEADER = json.dumps({"eval": {"task": "t", "model": "m/n"}})
_SAMPLE = {"id": "q", "output": {"choices": [{"message": {"content": "yes"}}]}}
_KNOWN = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
_ZSTANDARD = 93


def _write(folder, content, method, declared=None):
    """Write a log with one sample, which says that it is of another length."""
    path = folder / "a.eval"
    known = method in _KNOWN
    packed = content if known else pyarrow.compress(content, "zstd", asbytes=True)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("header.json", _HEADER)
        archive.writestr("samples/1.json", packed, method if known else zipfile.ZIP_STORED)
    data = bytearray(path.read_bytes())
    length = len(content) if declared is None else declared
    # Each header: signature, places of method and of length.
    for mark, of_method, of_length in ((b"PK\3\4", 8, 22), (b"PK\1\2", 10, 24)):
        at = data.rindex(mark)
        struct.pack_into("<H", data, at + of_method, method)
        struct.pack_into("<I", data, at + of_length, length)
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, _ZSTANDARD])
def test_three_packings_are_read(tmp_path, method):
    (reply,) = read_reply_log(_write(tmp_path, json.dumps(_SAMPLE).encode(), method))
    assert (reply.text, reply.question_id) == ("yes", "q")


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA, 9, 95, 98])
def test_other_packings_are_refused(tmp_path, method):
    path = _write(tmp_path, json.dumps(_SAMPLE).encode(), method)
    with pytest.raises(DataError, match="packed in another way than deflate or zstandard"):
        list(read_reply_log(path))


@pytest.mark.parametrize("method", [*_KNOWN, _ZSTANDARD])
@pytest.mark.parametrize("declared", [0, 200, 1 << 20])
def test_a_member_that_is_longer_than_it_says_fills_no_memory(tmp_path, method, declared):
    path = _write(tmp_path, json.dumps(_SAMPLE).encode() + b" " * (16 << 20), method, declared)
    tracemalloc.start()
    with pytest.raises(DataError, match=r"a\.eval: not a log of inspect_ai"):
        list(read_reply_log(path))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 4 << 20


@pytest.mark.parametrize("method", [zipfile.ZIP_DEFLATED, _ZSTANDARD])
def test_a_member_that_is_shorter_than_it_says_is_refused(tmp_path, method):
    path = _write(tmp_path, json.dumps(_SAMPLE).encode(), method, declared=10_000)
    with pytest.raises(DataError, match="not a log of inspect_ai"):
        list(read_reply_log(path))


def test_all_members_together_have_a_limit(tmp_path, monkeypatch):
    monkeypatch.setenv("INFTHOR_EVAL_MAX_FILE_MB", "1")
    path = tmp_path / "a.eval"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("header.json", _HEADER)
        for number in range(3):
            archive.writestr(f"samples/{number}.json", json.dumps(_SAMPLE) + " " * 400_000)
    with pytest.raises(DataError, match=r"is longer than 1 MB.*INFTHOR_EVAL_MAX_FILE_MB"):
        list(read_reply_log(path))
