"""Rehearsing a model: running its code on shapes, timing pictures, adding up a set's files."""

import math
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import islice
from pathlib import Path
from statistics import fmean
from typing import Any

from infthor_eval.cli.rehearsal.results import (
    Attention,
    Context,
    Frames,
    Gpu,
    Images,
    Rehearsed,
    Task,
)
from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.published.hub_data import default_folder
from infthor_eval.runs import Catalog, TaskFile
from infthor_eval.storage.folders import packaged_folder
from model_adapters.hf.rehearsal.model import RehearsedModel, load_shapes
from model_adapters.hf.rehearsal.usage import FrameWork, Rehearsal, Usage
from model_adapters.options.checkpoints import CheckpointOptions
from model_adapters.registry import name_on_engine, read_options

_GIGABYTES = (24, 48, 80, 141)  # of common GPUs
_CONTEXTS = (8_192, 32_768, 131_072, 524_288, 1_048_576)  # tokens
_STEP = 1024  # tokens that the largest context is found to
# Of benchmarks/cost.md, for an H100: share of the memory that is used, operations in a second in
# products of matrices and in attention.
_USABLE = 0.9
_MATRIX_FLOP = 400e12
_ATTENTION_FLOP = 200e12
_TEXT = 110  # tokens of a question and a reply
_MOST_GPUS = 64
_SECONDS = 2.0  # to time pictures
# The published test set: trajectories, frames of the longest and of the median one.
_PUBLISHED = (208, 1223, 929)
_SAMPLES = 32  # frames that are timed
_BUNDLED = "sets/nieh_mini"


def rehearse(
    model: str, texts: Mapping[str, str], tasks: Sequence[str], data: Path | None
) -> Rehearsed:
    """Rehearse one model.

    Args:
        model: name of the model.
        texts: its options as typed.
        tasks: names of tasks and groups.
        data: folder of the set; None for the published one where it was downloaded, else for the
            published numbers.
    """
    files = Catalog.find_installed().expand(tasks)
    options = read_options(model, texts)
    if not isinstance(options, CheckpointOptions):
        raise UsageError(
            f"{model} loads no checkpoint in transformers, so it cannot be rehearsed; name a model "
            "that does (`infthor-eval ls models`)"
        )
    frames, samples = _frames(data, files)
    rehearsed = load_shapes(options)
    run = Rehearsal(rehearsed, samples)
    flash = None if run.flash_problem else Rehearsal(rehearsed, samples, flash=True)
    contexts = [_context(run.usage(n), flash) for n in _CONTEXTS]
    per_frame = run.frame_tokens or None
    needs = [Task(file.name, _tokens(file, frames, per_frame)) for file in files]
    longest = max((need.tokens for need in needs if need.tokens is not None), default=_CONTEXTS[0])
    return Rehearsed(
        model=model,
        checkpoint=options.pretrained,
        source=rehearsed.source,
        parameters=rehearsed.model.num_parameters(),
        weights=_bytes_by_type(rehearsed.model),
        limit=rehearsed.limit,
        frame_tokens=per_frame,
        problem=rehearsed.problem,
        flash_problem=run.flash_problem,
        attention=_attention(run.usage(_CONTEXTS[-1])),
        contexts=contexts,
        gpus=[_gpu(gigabytes, run, flash, longest) for gigabytes in _GIGABYTES],
        images=_images(rehearsed, samples, run.frame_work(longest // 2)) if per_frame else None,
        frames=frames,
        tasks=needs,
        commands=_commands(model, texts, tasks, options, run.usage(longest)),
    )


def _bytes_by_type(model: Any) -> dict[str, int]:
    sizes: Counter[str] = Counter()
    for tensor in (*model.parameters(), *model.buffers()):
        sizes[str(tensor.dtype).removeprefix("torch.")] += tensor.nbytes
    return dict(sizes.most_common())


def _context(usage: Usage, flash: Rehearsal | None) -> Context:
    return Context(
        tokens=usage.n_tokens,
        cache=usage.cache,
        activations=usage.activations,
        together=usage.together,
        features=usage.features,
        total=usage.total,
        with_flash=None if flash is None else flash.usage(usage.n_tokens).total,
    )


def _attention(usage: Usage) -> list[Attention]:
    found = []
    for part, kernels in usage.kernels.items():
        for (kernel, has_mask, head_size), calls in kernels.items():
            found.append(Attention(part, kernel, has_mask, head_size, calls))
    return found


def _gpu(gigabytes: int, run: Rehearsal, flash: Rehearsal | None, longest: int) -> Gpu:
    memory = gigabytes * 1e9 * _USABLE
    tokens = run.largest(memory, _STEP)
    return Gpu(
        gigabytes=gigabytes,
        tokens=tokens,
        frames=tokens // run.frame_tokens if run.frame_tokens else None,
        tokens_with_flash=None if flash is None else flash.largest(memory, _STEP),
        needed=math.ceil(run.usage(longest).total / memory),
    )


def _images(rehearsed: RehearsedModel, samples: Sequence[FrameRef], work: FrameWork) -> Images:
    """Time reading and scaling of frames, one at a time, for some seconds, by processor time: other
    work on the machine does not count."""
    if rehearsed.process is None:
        raise ValueError("no frames to time")
    rehearsed.process([samples[0].load()])  # what is built at the first call is not timed
    start = time.process_time()
    n = 0
    while (seconds := time.process_time() - start) < _SECONDS:
        rehearsed.process([samples[n % len(samples)].load()])
        n += 1
    by_gpu = 1 / (work.flop / _MATRIX_FLOP + work.attention / _ATTENTION_FLOP)
    return Images(here=n / seconds, measured=n, flop=work.flop + work.attention, by_gpu=by_gpu)


def _frames(data: Path | None, files: Sequence[TaskFile]) -> tuple[Frames, list[FrameRef]]:
    """Return the numbers of the set's frames, and some of them."""
    root = data
    if root is None and any("bundled" in _settings(file) for file in files):
        root = packaged_folder(_BUNDLED)
    if root is None and (default_folder() / "metadata").is_dir():
        root = default_folder()
    if root is not None:
        return _counted(root)
    known, samples = _counted(packaged_folder(_BUNDLED))
    trajectories, longest, median = _PUBLISHED
    total = trajectories * median
    disk = int(known.disk / known.total * total)
    source = "published numbers; files as large as ours (`infthor-eval fetch nieh`)"
    return Frames(source, trajectories, longest, None, total, known.size, disk), samples


def _counted(root: Path) -> tuple[Frames, list[FrameRef]]:
    contents = NiehSet(root)
    by_trajectory = [
        contents.frames(name)
        for name in sorted({question.traj_id for question in contents.questions})
    ]
    refs = [ref for frames in by_trajectory for ref in frames]
    if not refs:
        raise UsageError(f"{root}: has no frames; give a set with its trajectories")
    known = [size for ref in refs if (size := ref.n_bytes) is not None]
    disk = int(fmean(known) * len(refs)) if known else 0
    counted = Frames(
        source=str(root),
        trajectories=len(by_trajectory),
        longest=max(map(len, by_trajectory)),
        most_clues=max(len(question.clues) for question in contents.questions),
        total=len(refs),
        size=refs[0].size,
        disk=disk,
    )
    return counted, list(islice(refs, 0, None, max(1, len(refs) // _SAMPLES)))


def _settings(file: TaskFile) -> Mapping[str, Any]:
    return file.settings.get("dataset_kwargs") or {}


def _tokens(file: TaskFile, frames: Frames, per_frame: int | None) -> int | None:
    """Return the tokens of a task's longest context."""
    settings = _settings(file)
    if "ctx_size" in settings:
        return int(settings["ctx_size"] * 1000) + _TEXT
    by_context = {"trajectory": frames.longest, "clues": frames.most_clues}
    n_frames = by_context.get(settings.get("context", ""))
    return None if n_frames is None or per_frame is None else n_frames * per_frame + _TEXT


def _commands(
    model: str,
    texts: Mapping[str, str],
    tasks: Sequence[str],
    options: CheckpointOptions,
    longest: Usage,
) -> list[str]:
    """Return what to type on the machine with the GPU."""
    given = "".join(f",{name}={text}" for name, text in texts.items() if name != "dtype")
    arguments = f"--model-args dtype=bfloat16{given}"
    run = f"--model {model} {arguments} --tasks {','.join(tasks)}"
    commands = []
    if not Path(options.pretrained).is_dir():
        commands.append(f"hf download {options.pretrained}")
    commands += [
        "infthor-eval fetch nieh",
        f"infthor-eval plan {run} --price-per-hour 3",
        f"infthor-eval {run}",
    ]
    needed = math.ceil(longest.total / (_GIGABYTES[2] * 1e9 * _USABLE))
    if needed > 1 and _runs_on_vllm(model):
        size = 2 ** math.ceil(math.log2(min(needed, _MOST_GPUS)))
        commands.append(
            f"infthor-eval {run} --engine vllm".replace(
                arguments, f"{arguments},tensor_parallel_size={size}"
            )
        )
    return commands


def _runs_on_vllm(model: str) -> bool:
    try:
        name_on_engine(model, "vllm")
    except UsageError:
        return False
    return True
