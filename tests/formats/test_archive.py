import io
import tarfile

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.archive import unpack_tar


def tar_of(path, *members):
    with tarfile.open(path, "w") as tar:
        for name, content in members:
            info = tarfile.TarInfo(name)
            if isinstance(content, bytes):
                info.size = len(content)
                tar.addfile(info, io.BytesIO(content))
            else:
                info.type, info.linkname = content
                tar.addfile(info)
    return path


def test_a_sound_archive_is_unpacked(tmp_path):
    archive = tar_of(tmp_path / "a.tar", ("metadata/t/img/0.png", b"pixels"))
    unpack_tar(archive, tmp_path / "out" / "metadata")
    assert (tmp_path / "out" / "metadata" / "t" / "img" / "0.png").read_bytes() == b"pixels"


@pytest.mark.parametrize(
    ("member", "expected"),
    [
        (("../evil", b"x"), "points outside"),
        (("metadata/../../evil", b"x"), "points outside"),
        (("/metadata/evil", b"x"), "points outside"),
        (("metadata/link", (tarfile.SYMTYPE, "/etc/passwd")), "link or device"),
        (("metadata/link", (tarfile.LNKTYPE, "metadata/t")), "link or device"),
        (("metadata/fifo", (tarfile.FIFOTYPE, "")), "link or device"),
        (("other/file", b"x"), "not below metadata/"),
        (("metadata/big", b"x" * 2000), "more than the limit"),
    ],
)
def test_a_member_that_is_refused_leaves_nothing_behind(tmp_path, member, expected):
    archive = tar_of(tmp_path / "a.tar", ("metadata/good", b"x"), member)
    with pytest.raises(DataError, match=expected):
        unpack_tar(archive, tmp_path / "out" / "metadata", max_bytes=1000)
    assert list((tmp_path / "out").iterdir()) == []
    assert not (tmp_path / "evil").exists()


def test_damaged_and_empty_archives_are_named(tmp_path):
    (tmp_path / "bad.tar").write_bytes(b"no archive")
    with pytest.raises(DataError, match=r"bad\.tar: a damaged archive"):
        unpack_tar(tmp_path / "bad.tar", tmp_path / "metadata")
    whole = tar_of(tmp_path / "a.tar", ("metadata/x", b"x" * 5000)).read_bytes()
    (tmp_path / "cut.tar").write_bytes(whole[:3000])
    with pytest.raises(DataError, match=r"cut\.tar"):
        unpack_tar(tmp_path / "cut.tar", tmp_path / "metadata")
    with pytest.raises(DataError, match="empty archive"):
        unpack_tar(tar_of(tmp_path / "e.tar"), tmp_path / "metadata")
    assert not (tmp_path / "metadata").exists()
