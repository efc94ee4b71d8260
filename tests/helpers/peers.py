"""Packages of others that a test needs in this process, from folders of their own.

`make test` puts the folders beside the packages that it installs; PEER_FOLDERS names another place.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


def peer_packages(name: str) -> Path:
    """The folder of packages that a harness needs beside ours."""
    return Path(os.environ.get("PEER_FOLDERS", sys.prefix)) / name


def needs_peer(name: str) -> pytest.MarkDecorator:
    """Skips tests where a folder is not there."""
    folder = peer_packages(name)
    return pytest.mark.skipif(not folder.is_dir(), reason=f"no {folder}; `make test` puts it there")


@contextmanager
def peer_imports(name: str) -> Iterator[None]:
    """Lets a folder's packages be imported that ours has not."""
    folder = str(peer_packages(name))
    sys.path.append(folder)
    try:
        yield
    finally:
        sys.path.remove(folder)
