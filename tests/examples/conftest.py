"""Example packages, installed as pip installs them."""

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="session")
def install(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Installs an example and gives the folder to import it from; nothing is downloaded."""

    def install(name: str) -> Path:
        # Setuptools writes into it.
        source = shutil.copytree(EXAMPLES / name, tmp_path_factory.mktemp("source") / name)
        target = tmp_path_factory.mktemp("installed")
        quietly = (
            "--quiet",
            "--disable-pip-version-check",
            "--no-index",
            "--no-deps",
            "--no-build-isolation",
        )
        subprocess.run(
            [sys.executable, "-m", "pip", "install", *quietly, "--target", target, source],
            check=True,
        )
        return target

    return install
