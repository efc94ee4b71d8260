"""Sets on a hub that is a local server."""

import json

import pytest
from PIL import Image

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.packed.hub import set_folder
from infthor_eval.formats.packed.writing import pack_set
from infthor_eval.formats.question import Question
from infthor_eval.formats.step_log import read_steps
from tests.helpers.command_line import option_words, read_success
from tests.helpers.hub import COMMIT, serve_hub, use_hub
from tests.model_adapters.language_models import SETTINGS, save_language_model

NAME = "me/my_set"
N_TRAJECTORIES = 40


@pytest.fixture
def folder(make_nieh_set):
    """A set of 40 trajectories."""
    asked = [Question(f"t{at:02d}", "What?", (1, 3), ("cup",)) for at in range(N_TRAJECTORIES)]
    root = make_nieh_set(asked, n_frames=30, size=64)
    for picture in root.rglob("*.png"):  # of the size of a real one
        Image.effect_noise((160, 160), 80).save(picture)
    return root


@pytest.fixture
def hub(folder, tmp_path, monkeypatch):
    """The server of that set, packed."""
    packed = tmp_path / "packed"
    packed.mkdir()
    pack_set(NiehSet(folder), packed)
    files = {path.name: path.read_bytes() for path in packed.iterdir()}
    with serve_hub(f"datasets/{NAME}", files) as (address, answers):
        use_hub(monkeypatch, address)
        yield answers


SEEING = ("qwen2.5-vl-tiny", "llava-onevision-tiny", "pixtral-tiny", "deepseek-vl-tiny")
READING = ("llama", "gpt2")


@pytest.mark.slow
@pytest.mark.parametrize("model", [*SEEING, *READING])
def test_replies_of_a_run_are_those_of_the_folder(model, hub, run_cli, tmp_path):
    """Of a run by the address, on an empty cache, against one on a folder."""
    asked = {"model": model, "tasks": "nieh_gt"}
    if model in READING:
        save_language_model(tmp_path / model, model, **SETTINGS[model])
        asked = {"model": f"hf-lm:pretrained={tmp_path / model}", "tasks": "nieh_memory"}
        asked |= {"memory": "text-log", "frames": "none"}
    replies = []
    for place in ("hf://me/my_set", tmp_path / "set"):
        out = tmp_path / f"out-{len(replies)}"
        words = option_words(**asked, data=place, limit=4, out=out)
        read_success(run_cli(*words))
        (file,) = out.rglob("samples_*.jsonl")
        replies.append([json.loads(line)["resps"] for line in file.read_text().splitlines()])
        replies[-1].append(file.parent.name)  # it has the hash of the run's config
    assert replies[0] == replies[1]


def test_it_is_the_set_of_the_folder(hub, folder):
    one, other = NiehSet(folder), NiehSet(set_folder(f"hf://{NAME}"))
    assert other.rows == one.rows
    assert other.fingerprint == one.fingerprint
    for mine, theirs in zip(one.frames("t07"), other.frames("t07"), strict=True):
        assert theirs.load().tobytes() == mine.load().tobytes()
    assert read_steps(other.folder("t07")) == read_steps(one.folder("t07"))


def test_of_one_trajectory_little_more_is_fetched(hub):
    data = NiehSet(set_folder(f"hf://{NAME}@{COMMIT}"))
    for frame in data.frames("t07"):
        frame.load()
    data.outline("t07")
    n_bytes = sum(map(len, hub.files.values()))
    assert sum(hub.n_bytes.values()) < 0.06 * n_bytes, hub.n_bytes


def test_frames_are_kept(hub):
    for _ in range(2):
        data = NiehSet(set_folder(f"hf://{NAME}"))
        data.clue_frames(data.questions[0])[0].load()
        fetched = hub.n_bytes["frames-00000-of-00001.parquet"]
        hub.n_bytes.clear()
    footer = fetched
    data = NiehSet(set_folder(f"hf://{NAME}"))
    assert hub.n_bytes["frames-00000-of-00001.parquet"] == footer


def test_a_hub_that_ends_fails_the_frame_alone(hub):
    data = NiehSet(set_folder(f"hf://{NAME}"))
    first, second = data.clue_frames(data.questions[0])[0], data.frames("t39")[0]
    first.load()
    hub.status = 404
    with pytest.raises(DataError) as refused:
        second.load()
    assert "\n" not in str(refused.value)
    first.load()


@pytest.mark.parametrize(
    ("place", "error", "words"),
    [
        ("hf://nobody", UsageError, "hf://OWNER/NAME"),
        ("hf://a/b/c", UsageError, "hf://OWNER/NAME"),
        ("hf://else/where", DataError, "check the name"),
    ],
)
def test_an_address_that_is_none_is_refused(hub, place, error, words):
    with pytest.raises(error, match=words):
        set_folder(place)
