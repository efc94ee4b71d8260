"""`infthor-eval check parity`, against a server that a tiny twin answers for."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from PIL import Image

from model_adapters.policies.parity import load_policy

from ...helpers.command_line import assert_refused, read_success
from ...model_adapters.policies.servers import policy_answers, serve

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with serve(policy_answers(load_policy("openvla-tiny", {}))) as address:
        yield address


def test_equal_policies_end_with_0(run_cli: Run, url: str) -> None:
    out, _ = read_success(run_cli("check", "parity", "openvla-tiny", "--reference-url", url))
    assert "openvla-tiny and its reference" in out
    assert "counts as equal: equal." in out
    assert out.count("pick up the") == 2


def test_different_policies_end_with_1(run_cli: Run, tmp_path: Path) -> None:
    Image.new("RGB", (64, 64), "red").save(tmp_path / "red.png")
    words = ("--frames", tmp_path, "--instruction", "open the drawer")
    with serve(policy_answers(load_policy("openvla-tiny", {}), change=0.125)) as other:
        code, out, _ = run_cli("check", "parity", "openvla-tiny", "--reference-url", other, *words)
        tolerated, _, _ = run_cli(
            *("check", "parity", "openvla-tiny", "--reference-url", other, *words),
            *("--tolerance", "0.2"),
        )
    assert (code, tolerated) == (1, 0)
    assert "0.12" in out
    assert "open the drawer" in out
    assert ": different." in out


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("openvla-tin", "--reference-url", "http://127.0.0.1:9"), "did you mean 'openvla-tiny'"),
        (("openvla-tiny",), "--reference-url"),
        (
            ("openvla-tiny", "--reference-url", "nowhere"),
            "--reference-url: url is not the address of a server",
        ),
        (
            ("openvla-tiny", "--reference-url", "http://x", "--frames", "/nowhere"),
            "has no pictures",
        ),
        (
            ("openvla-tiny", "--reference-url", "http://x", "--model-args", "unnorm_key=a"),
            "unnorm_key=a is not a dataset",
        ),
    ],
)
def test_misuse_is_one_line(run_cli: Run, words: tuple[str, ...], expected: str) -> None:
    assert_refused(run_cli("check", "parity", *words), expected, after_notes=True)
