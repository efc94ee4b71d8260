"""Unpacking downloaded archives.

An archive is untrusted: its members may point outside the folder, be links or devices, or unpack to
more than the disk holds. Nothing is unpacked unless every member is a plain file or a folder below
the target.
"""

import gzip
import shutil
import tarfile
from pathlib import Path, PurePosixPath
from typing import Self

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.reading import DAMAGED, require_file
from infthor_eval.storage.files import writing_hint
from infthor_eval.storage.scratch import ScratchFolder

_MAX_FILES = 2_000_000
_MAX_FILE_BYTES = 2 * 2**30
_MAX_HEADER_BYTES = 2**20  # of a long name or of attributes, which are read into memory at once
_LONGEST_END = 2**24  # a tape's record, which `tar -b` may ask for, is shorter
_HEADERS = (
    tarfile.XHDTYPE,
    tarfile.XGLTYPE,
    tarfile.SOLARIS_XHDTYPE,
    tarfile.GNUTYPE_LONGNAME,
    tarfile.GNUTYPE_LONGLINK,
)


def unpack_tar(archive: Path, target: Path, max_bytes: int = 500 * 2**30) -> None:
    """Unpack the one top folder of a tar file as `target`, completely or not at all.

    Args:
        archive: the tar file, compressed or not.
        target: the folder to create; it has the name of the archive's top folder.
        max_bytes: maximum size of the unpacked content, in bytes.
    """
    require_file(archive, "fetch it again")
    damaged = (tarfile.TarError, gzip.BadGzipFile, *DAMAGED)
    with (
        wrap_errors(
            f"{archive}: cannot be unpacked to {target}",
            writing_hint(", or fetch the archive again"),
        ),
        wrap_errors(f"{archive}: a damaged archive", "delete it and fetch it again", catch=damaged),
    ):
        target.parent.mkdir(parents=True, exist_ok=True)
        with (
            tarfile.open(archive, tarinfo=_BoundedInfo) as tar,
            ScratchFolder(target.parent) as scratch,
        ):
            members = _check_members(
                tar, archive, target.name, min(max_bytes, shutil.disk_usage(target.parent).free)
            )
            tar.extractall(scratch, members=members, filter="data")
            (scratch / target.name).rename(target)


class _BoundedInfo(tarfile.TarInfo):
    """A header whose own data fit into memory."""

    @classmethod
    def frombuf(cls, buf: bytes | bytearray, encoding: str, errors: str) -> Self:
        info = super().frombuf(buf, encoding, errors)
        if info.type in _HEADERS and info.size > _MAX_HEADER_BYTES:
            raise tarfile.ReadError(f"a header of {info.size:,} bytes")
        return info


def _check_end(tar: tarfile.TarFile) -> None:
    """Check that all members were read: tarfile takes a damaged header for the archive's end."""
    assert tar.fileobj is not None
    tar.fileobj.seek(tar.offset)
    if tar.fileobj.read(tarfile.BLOCKSIZE) != bytes(tarfile.BLOCKSIZE):
        raise tarfile.ReadError(f"no header and no end at byte {tar.offset:,}")
    # To the end, where compressed files have a checksum; before it are zeros up to a whole record.
    if len(tar.fileobj.read(_LONGEST_END + 1)) > _LONGEST_END:
        raise tarfile.ReadError(f"more than {_LONGEST_END:,} bytes after its end")


def _check_members(
    tar: tarfile.TarFile, archive: Path, top: str, max_bytes: int
) -> list[tarfile.TarInfo]:
    """Return the members of an archive, all of which are safe to unpack."""
    members = []
    total = 0
    seen: set[PurePosixPath] = set()
    for member in tar:
        path = PurePosixPath(member.name)
        if path in seen and not member.isdir():
            raise DataError(f"{archive}: contains {member.name!r} twice; do not use this archive")
        seen.add(path)
        if path.is_absolute() or ".." in path.parts:
            raise DataError(
                f"{archive}: {member.name!r} points outside the folder; do not use this archive"
            )
        if not (member.isfile() or member.isdir()):
            raise DataError(
                f"{archive}: {member.name!r} is a link or device; do not use this archive"
            )
        if path.parts and path.parts[0] != top:
            raise DataError(
                f"{archive}: {member.name!r} is not below {top}/; this is another archive"
            )
        total += member.size
        members.append(member)
        if member.size > _MAX_FILE_BYTES or total > max_bytes or len(members) > _MAX_FILES:
            raise DataError(
                f"{archive}: unpacks to more than the limit or the free disk; make room or check "
                "the file"
            )
    _check_end(tar)
    if not members:
        raise DataError(f"{archive}: empty archive; delete it and fetch it again")
    return members
