#!/usr/bin/env python3
"""Build the wheel and the source distribution of a commit: equal commits give equal bytes.

    .ci/release.py dist

`make release` calls it. Files are those of the commit, not of the checkout; times are the commit's
(SOURCE_DATE_EPOCH), owners nobody's. Bytes are equal wherever setuptools and zlib are the same.
"""

import argparse
import gzip
import io
import os
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
_HOOKS = """
import sys
from setuptools import build_meta
getattr(build_meta, sys.argv[1])(sys.argv[2])
"""


def build_release(out: Path, commit: str = "HEAD") -> list[Path]:
    """Write the wheel and the source distribution of a commit into a folder; return their paths."""
    out.mkdir(parents=True, exist_ok=True)
    epoch = int(_git("show", "--no-patch", "--format=%ct", commit))
    with tempfile.TemporaryDirectory() as scratch:
        for kind in ("sdist", "wheel"):  # each in a copy of its own, as setuptools writes into it
            source = Path(scratch) / kind
            files = io.BytesIO(_git("archive", "--format=tar", commit))
            with tarfile.open(fileobj=files) as archive:
                archive.extractall(source, filter="data")  # with modes that no umask changes
            build(source, kind, Path(scratch) / "built", epoch)
        built = sorted((Path(scratch) / "built").iterdir())
        for path in built:
            is_archive = path.suffix == ".gz"
            content = normal_archive(path, epoch) if is_archive else path.read_bytes()
            (out / path.name).write_bytes(content)
    return [out / path.name for path in built]


def build(source: Path, kind: str, out: Path, epoch: int) -> None:
    """Build a `wheel` or an `sdist` from sources into a folder, without the network."""
    out.mkdir(parents=True, exist_ok=True)
    subprocess.run(
        [sys.executable, "-c", _HOOKS, f"build_{kind}", out],
        cwd=source,
        env={**os.environ, "SOURCE_DATE_EPOCH": str(epoch), "PYTHONHASHSEED": "0"},
        umask=0o022,  # files of a wheel have modes, too
        capture_output=True,
        check=True,
    )


def normal_archive(path: Path, epoch: int) -> bytes:
    """Return a `.tar.gz` with its files in order, of one time and no owner."""
    plain = io.BytesIO()
    with tarfile.open(path) as given, tarfile.open(fileobj=plain, mode="w") as normal:
        for member in sorted(given.getmembers(), key=lambda member: member.name):
            member.mtime = epoch
            member.uid = member.gid = 0
            member.uname = member.gname = ""
            member.mode = 0o755 if member.isdir() or member.mode & 0o100 else 0o644
            member.pax_headers = {}
            normal.addfile(member, given.extractfile(member) if member.isfile() else None)
    return gzip.compress(plain.getvalue(), mtime=epoch)


def _git(*words: str) -> bytes:
    return subprocess.run(["git", "-C", ROOT, *words], stdout=subprocess.PIPE, check=True).stdout


def main() -> None:
    """Build, and print the paths."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path, help="folder of the files")
    parser.add_argument("--commit", default="HEAD", help="default: HEAD")
    given = parser.parse_args()
    print(*build_release(given.out, given.commit), sep="\n")


if __name__ == "__main__":
    main()
