"""Packages of others that a test needs in this process, from environments of their own.

`make test` puts the environments beside the packages that it installs; PEERS names another folder.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


def peer_packages(name: str) -> Path:
    """The folder of an environment's packages."""
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    return Path(os.environ.get("PEERS", sys.prefix)) / name / "lib" / version / "site-packages"


def needs_peer(name: str) -> pytest.MarkDecorator:
    """Skips tests where an environment is not there."""
    folder = peer_packages(name)
    return pytest.mark.skipif(not folder.is_dir(), reason=f"no {folder}; `make test` puts it there")


@contextmanager
def peer_imports(name: str) -> Iterator[None]:
    """Lets an environment's packages be imported that ours has not."""
    folder = str(peer_packages(name))
    sys.path.append(folder)
    try:
        yield
    finally:
        sys.path.remove(folder)
