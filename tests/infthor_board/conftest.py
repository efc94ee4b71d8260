"""Runs that submissions are made of, and the owner who checks them."""

from collections.abc import Callable
from pathlib import Path

import pytest

from infthor_board.checking import Verdict, check_submissions
from infthor_board.cli import main
from infthor_board.expected import Owner
from tests.helpers.command_line import CliRunner, runner_of
from tests.helpers.twin_sets import write_twin_set
from tests.infthor_board.material import Material, make_material, write_home_set


@pytest.fixture
def run_board(capfd: pytest.CaptureFixture[str]) -> CliRunner:
    """Runs `infthor-board` as `run_cli` does our other command."""
    return runner_of(main, capfd)


@pytest.fixture(scope="session")
def material(tmp_path_factory: pytest.TempPathFactory) -> Material:
    """Two sets, and runs on them."""
    folder = tmp_path_factory.mktemp("submissions")
    homes = write_home_set(folder / "homes")
    twins = write_twin_set(folder / "twins", range(1, 26))
    return make_material(folder / "results", homes, twins)


@pytest.fixture(scope="session")
def owner(material: Material) -> Owner:
    """Who checks, with both sets."""
    return Owner([material.homes, material.twins])


@pytest.fixture
def check(owner: Owner) -> Callable[..., Verdict]:
    """Checks one submission, maybe against others."""

    def check(folder: Path, others: Path | None = None, **options: object) -> Verdict:
        (verdict,) = check_submissions(folder, owner, others, **options)
        return verdict

    return check
