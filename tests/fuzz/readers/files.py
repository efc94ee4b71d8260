"""Frames, films, archives, logs of others, manifests."""

import io
import json
import os
import shutil
import tarfile
import zipfile
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from infthor_eval.formats.archive import unpack_tar
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.pictures.blank import blank_like
from infthor_eval.formats.pictures.video import read_video
from infthor_eval.formats.plan_logs import is_plan_log, read_plan_log
from infthor_eval.generation.bundle import read_manifest
from infthor_eval.nieh.published.imported_replies import import_logs
from infthor_eval.plans.published.imported_counts import import_counts

from ..damage import Form
from ..reader import Reader
from .samples import make_set

__all__ = ["READERS"]


def _make_frame(name: str, folder: Path) -> Path:
    pixels = np.random.default_rng(0).integers(0, 255, (24, 32, 3), dtype=np.uint8)
    Image.fromarray(pixels).save(folder / name)
    return folder / name


def _read_frame(name: str, folder: Path) -> None:
    frame = FrameRef(folder / name)
    problem = frame.problem
    assert problem is None or "\n" not in problem
    image = frame.load()
    assert image.size == (32, 24) or image.width * image.height < 10**8
    blank_like(frame)


def _make_film(folder: Path) -> Path:
    os.environ["XDG_CACHE_HOME"] = str(folder / "cache")
    video = cv2.VideoWriter(str(folder / "a.mp4"), cv2.VideoWriter_fourcc(*"mp4v"), 10.0, (32, 32))
    for grey in range(0, 250, 25):
        video.write(np.full((32, 32, 3), grey, np.uint8))
    video.release()
    return folder / "a.mp4"


def _read_film(folder: Path) -> None:
    shutil.rmtree(folder / "cache", ignore_errors=True)
    read_video(folder / "a.mp4", 2.0)


def _make_archive(mode: str, folder: Path) -> Path:
    path = folder / "a.tar"
    with tarfile.open(path, mode) as tar:  # type: ignore[call-overload]
        for number in range(3):
            info = tarfile.TarInfo(f"metadata/{number}/a.json")
            info.size = 300
            tar.addfile(info, io.BytesIO(bytes(range(100)) * 3))
    return path


def _unpack(folder: Path) -> None:
    target = folder / "metadata"
    shutil.rmtree(target, ignore_errors=True)
    unpack_tar(folder / "a.tar", target, 2**20)
    outside = [path for path in folder.iterdir() if path.name not in {"a.tar", "metadata"}]
    assert not outside, f"unpacked outside of the target: {outside}"


def _make_replies(folder: Path) -> Path:
    (one, two, *_) = NiehSet(make_set(folder)).questions
    published = {
        "qidx": 0, "traj_id": one.traj_id, "question": one.text, "gt_img_idx": list(one.clues),
        "gt_answer": ["yes"],
        "llm_response": "yes", "score": 1.0, "ctx_n_tokens": 7, "eval_mode": "full_traj",
        "ctx_size_k": 1.0,
        "n_imgs": 4, "selected_img_indices": [0, 1],
    }  # fmt: skip
    rows = [
        {
            "question_id": two.id,
            "reply": "Bed",
            "n_context_tokens": 9,
            "n_reply_tokens": 2,
            "seconds": 1.5,
            "frames_shown": [0],
        },
        published,
        {"doc": {"question_id": one.id}, "resps": [["yes"]]},
        {
            "evaluation_id": "e", "sample_id": one.id, "model_id": "m/n",
            "output": {"raw": ["yes", "no"], "reasoning_trace": ["a mug"]},
            "token_usage": {"input_tokens": 9, "output_tokens": 2},
            "performance": {"latency_ms": 1.5},
            "metadata": {"repeat": "2", "variant": "v", "frames": "0-1,3", "context": "clues"},
        },
    ]  # fmt: skip
    (folder / "log.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    return folder / "log.jsonl"


def _make_inspect_log(folder: Path) -> Path:
    (one, *_) = NiehSet(make_set(folder)).questions
    content = [{"type": "reasoning", "reasoning": "a mug"}, {"type": "text", "text": "yes"}]
    sample = {
        "id": one.id,
        "epoch": 2,
        "output": {"choices": [{"message": {"content": content}}]},
        "model_usage": {"m/n": {"input_tokens": 9, "output_tokens": 2}},
        "total_time": 1.5,
    }
    with zipfile.ZipFile(folder / "log.eval", "w") as archive:
        archive.writestr("header.json", json.dumps({"eval": {"task": "t", "model": "m/n"}}))
        archive.writestr("samples/1.json", json.dumps(sample))
    return folder / "log.eval"


def _import(name: str, folder: Path) -> None:
    data = NiehSet(folder)
    for run in import_logs([folder / name], data, "model"):
        assert all("\n" not in item.reason for item in run.refused)
        run.header(data)


def _make_plan_log(folder: Path) -> Path:
    metric = {"total_count": 6, "success_count": 3, "agent_reward": 0}
    for name in ("goto", "pick", "put"):
        metric |= {f"{name}_count": 2, f"{name}_success": 1}
    path = folder / "eval_longhrz_checkpoints_some-model_step-5-hf_yarn_4.0.log"
    path.write_text(
        "".join(json.dumps({"traj_id": f"t{n}", "metric": metric}) + "\n" for n in range(3))
    )
    return path


def _read_plan_log(folder: Path) -> None:
    (path,) = folder.iterdir()
    is_plan_log(path)
    import_counts(read_plan_log(path), None)


def _make_manifest(folder: Path) -> Path:
    recipe = {"scene": "kitchen-1", "seed": 0, "min_steps": 1}
    (folder / "manifest.json").write_text(
        json.dumps({"name": "x", "trajectories": [recipe], "files": {"a": "b"}})
    )
    return folder / "manifest.json"


READERS = (
    Reader("frame PNG", Form.BYTES, partial(_make_frame, "a.png"), partial(_read_frame, "a.png")),
    Reader("frame JPEG", Form.BYTES, partial(_make_frame, "a.jpg"), partial(_read_frame, "a.jpg")),
    Reader("film", Form.BYTES, _make_film, _read_film),
    Reader("archive", Form.BYTES, partial(_make_archive, "w"), _unpack),
    Reader("packed archive", Form.BYTES, partial(_make_archive, "w:gz"), _unpack),
    Reader("reply log", Form.JSON_LINES, _make_replies, partial(_import, "log.jsonl")),
    Reader("inspect log", Form.BYTES, _make_inspect_log, partial(_import, "log.eval")),
    Reader("plan log", Form.JSON_LINES, _make_plan_log, _read_plan_log),
    Reader(
        "manifest",
        Form.JSON,
        _make_manifest,
        lambda folder: read_manifest(folder / "manifest.json"),
    ),
)
