"""`infthor-eval doctor`: what there is on this machine, and what to do where something is missing."""

import ctypes.util
import importlib.util
import os
import platform
import shutil
import sys
import threading
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Literal

import click
import msgspec
from rich.text import Text

from infthor_eval.errors import in_one_line
from infthor_eval.formats.hub_data import default_folder
from infthor_eval.formats.user_cache import user_cache
from infthor_eval.terminal import console, print_line, printable

__all__ = ["Check", "checks", "command"]

_STYLES = {"ok": "green", "optional": "yellow", "wrong": "red"}
_PATIENCE_S = 2.0  # for the hub
_GB = 1e9
_LEAST_DISK_GB = 20.0  # for one checkpoint of 7 billion parameters
_EXTRAS = {
    "openai": ("openai", "models behind a server (`--model openai`)"),
    "vllm": ("vllm", "models in vLLM (`--engine vllm`), on a GPU"),
    "ray": ("ray", "workers on a cluster (`--ray-address`)"),
    "train": ("peft", "training with low-rank adapters (`train --recipe`)"),
}


class Check(msgspec.Struct, frozen=True):
    """What was found of one thing.

    Attributes:
        name: of the thing.
        state: "ok"; "optional" where it is not there, and only some uses need it; "wrong" where none will do without.
        found: what is there, or why it is not.
        mend: what to do; empty where nothing is to be done.
    """

    name: str
    state: Literal["ok", "optional", "wrong"]
    found: str
    mend: str = ""


@click.command("doctor")
@click.option("--json", "as_json", is_flag=True, help="Write what was found as JSON.")
def command(as_json: bool) -> int:
    """Look at what evaluations need: Python, torch, simulators, the hub, disk, data; each with its mend.

    Ends with 1 where something is missing that nothing will do without.
    """
    found = []
    on = console()
    for check in checks():
        found.append(check)
        if not as_json:
            on.print(
                Text.assemble((f"{check.state:9}", _STYLES[check.state]), printable(f"{check.name}: {check.found}"))
            )
            if check.mend:
                print_line(f"{'':9}{check.mend}")
    if as_json:
        click.echo(msgspec.json.format(msgspec.json.encode(found), indent=2))
    return int(any(check.state == "wrong" for check in found))


def checks() -> Iterator[Check]:
    """All checks, one after the other; the hub has two seconds to answer."""
    yield Check("Python", "ok", f"{platform.python_version()}, {sys.executable}")
    yield _torch()
    yield _memory()
    yield _embedded()
    yield _unity()
    yield _display()
    yield _token()
    yield _hub()
    yield from _disks()
    yield _data()
    for extra, (module, use) in _EXTRAS.items():
        yield _extra(extra, module, use)


def _torch() -> Check:
    try:
        import torch
    except (ImportError, OSError) as error:
        return Check("torch", "wrong", f"cannot be imported ({in_one_line(error)})", "pip install torch")
    if torch.cuda.is_available():
        properties = torch.cuda.get_device_properties(0)
        return Check("torch", "ok", f"{torch.__version__}, {properties.name}, {properties.total_memory / _GB:.0f} GB")
    mend = "large models want a GPU and a torch built for it; tiny models, baselines and served ones need none"
    return Check("torch", "optional", f"{torch.__version__}, no GPU: models run on {os.cpu_count()} processors", mend)


def _memory() -> Check:
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / _GB
    return Check("memory", "ok", f"{total:.0f} GB")


def _embedded() -> Check:
    missing = [name for name in ("infthor_eval.sim", "numba") if importlib.util.find_spec(name) is None]
    if missing:
        return Check("embedded simulator", "wrong", f"no {missing[0]}", "install the package again: pip install .")
    return Check("embedded simulator", "ok", "there; its first start compiles the renderer, ten seconds")


def _unity() -> Check:
    folder = Path.home() / ".ai2thor" / "releases"
    builds = sorted(path.name for path in folder.glob("thor-*") if path.is_dir())
    try:
        package = f"ai2thor {version('ai2thor')}"
    except PackageNotFoundError:
        return Check("AI2-THOR", "wrong", "ai2thor is not installed", "install the package again: pip install .")
    if builds:
        return Check("AI2-THOR", "ok", f"{package}, build {builds[-1]}")
    mend = "`--simulator unity` downloads it when it is first used; the embedded simulator needs none"
    return Check("AI2-THOR", "optional", f"{package}, no build in {folder}", mend)


def _display() -> Check:
    there = [name for name, found in _displays() if found]
    if there:
        return Check("display", "ok", " and ".join(there))
    mend = "AI2-THOR's own build needs one: start an X server, or install Vulkan; the embedded simulator needs none"
    return Check("display", "optional", "neither an X server (DISPLAY) nor Vulkan", mend)


def _displays() -> Iterator[tuple[str, bool]]:
    yield f"X server {os.environ.get('DISPLAY', '')}", bool(os.environ.get("DISPLAY"))
    yield "Vulkan", ctypes.util.find_library("vulkan") is not None


def _token() -> Check:
    from huggingface_hub import get_token

    if get_token() is not None:
        return Check("hub token", "ok", "there is one")
    mend = "`hf auth login`, for data and models that are not given to everybody"
    return Check("hub token", "optional", "none", mend)


def _hub() -> Check:
    from huggingface_hub import constants

    mend = "checkpoints and data from the hub must lie in its cache, or in folders (pretrained=DIR, --data DIR)"
    if constants.HF_HUB_OFFLINE:
        return Check("hub", "optional", "not asked: HF_HUB_OFFLINE is set", mend)
    said = _within(_PATIENCE_S, lambda: _reached(constants.ENDPOINT))
    state: Literal["ok", "optional"] = "ok" if said == "" else "optional"
    found = f"{constants.ENDPOINT} answers" if said == "" else f"{constants.ENDPOINT} cannot be reached ({said})"
    return Check("hub", state, found, "" if said == "" else mend)


def _reached(url: str) -> str:
    """Why it is not to be reached; empty where it is."""
    try:
        urllib.request.urlopen(urllib.request.Request(url, method="HEAD"), timeout=_PATIENCE_S).close()
    except urllib.error.HTTPError:  # an answer all the same
        return ""
    except (OSError, ValueError) as error:
        return in_one_line(error)
    return ""


def _within(seconds: float, ask: Callable[[], str]) -> str:
    """An answer, or that there was none in time: looking a name up can take longer than any time-out of the asking."""
    answers: list[str] = []
    asking = threading.Thread(target=lambda: answers.append(ask()), daemon=True)
    asking.start()
    asking.join(seconds)
    return answers[0] if answers else f"no answer in {seconds:g} s"


def _disks() -> Iterator[Check]:
    for name, place in (("disk, here", Path.cwd()), ("disk, cache", user_cache(""))):
        there = next(folder for folder in (place, *place.parents) if folder.exists())
        free = shutil.disk_usage(there).free / _GB
        if free < _LEAST_DISK_GB:
            mend = "a checkpoint of 7 billion parameters takes 16 GB: make room, or set HF_HOME and XDG_CACHE_HOME"
            yield Check(name, "optional", f"{free:.1f} GB free in {there}", mend)
        else:
            yield Check(name, "ok", f"{free:.0f} GB free in {there}")


def _data() -> Check:
    folder = default_folder()
    if (folder / "metadata").is_dir():
        return Check("NIEH data", "ok", f"the published set, in {folder}")
    mend = "`infthor-eval fetch nieh`; the bundled set (`--tasks nieh_mini`) needs no download"
    return Check("NIEH data", "optional", f"the published set is not in {folder}", mend)


def _extra(extra: str, module: str, use: str) -> Check:
    if importlib.util.find_spec(module) is not None:
        return Check(f"extra {extra}", "ok", f"{module} {version(module)}: {use}")
    return Check(f"extra {extra}", "optional", f"not installed: {use}", f"pip install 'infthor-eval[{extra}]'")
