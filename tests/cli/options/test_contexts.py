"""Contexts with retrieval, video and memory, through the command line."""

import json
import os
import signal

import pytest

from infthor_eval.formats.question import Question
from infthor_eval.runs import read_header

from ...helpers.command_line import assert_refused, option_words, read_success
from ...helpers.files import find_one
from ...helpers.journals import count_records, read_records
from ...helpers.processes import finish, start_cli
from ...helpers.waiting import wait_until

QUESTIONS = [
    Question(traj_id, f"Is there a {name}?", (index,), ("yes",), "object_presence")
    for traj_id in ("traj_a", "traj_b")
    for index, name in enumerate(("mug", "plate", "sink"))
]


def docs(folder, task):
    return [
        json.loads(line)["doc"]
        for line in find_one(folder, f"samples_{task}_*.jsonl").read_text().splitlines()
    ]


@pytest.fixture
def data(make_nieh_set):
    return make_nieh_set(QUESTIONS, n_frames=45, size=56)


def test_retrieval_runs_through_and_the_retriever_is_part_of_the_run(
    data, make_clip, tmp_path, run_cli
):
    tasks, out = "nieh_clip_retrieval,nieh_memory_frames", tmp_path / "out"
    arguments = ["--model", "qwen2.5-vl-tiny", "--tasks", tasks, "--data", data, "--out", out]
    first, second = make_clip(seed=0), make_clip(seed=1)
    read_success(run_cli(*arguments, "--retriever", first))
    assert [len(doc["frames"]) for doc in docs(out, "nieh_clip_retrieval")] == [10] * 6
    assert [(len(doc["frames"]), doc["frames"][-1]) for doc in docs(out, "nieh_memory_frames")] == [
        (21, 44)
    ] * 6
    results = find_one(out, "results.json").read_bytes()
    _, _, err = run_cli(*arguments, "--retriever", first)
    assert "0 evaluated now, 12 resumed" in err
    assert find_one(out, "results.json").read_bytes() == results
    assert run_cli(*arguments, "--retriever", second)[0] == 0
    identities = [read_header(path.parent).config for path in out.rglob("journal")]
    retrievers = {
        task["sources"]["retriever"]["fingerprint"]
        for each in identities
        for task in each.tasks.values()
    }
    assert (len(identities), len(retrievers)) == (2, 2)


def test_a_missing_retriever_ends_in_one_line(data, tmp_path, run_cli, monkeypatch):
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_OFFLINE", True)
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path / "hub"))
    arguments = ["--model", "oracle", "--data", data, "--out", tmp_path / "out"]
    for tasks, options, *expected in (
        ("nieh_clip_retrieval", (), "not in the local cache", "and give --retriever DIR"),
        ("nieh_memory_frames", ("--retriever", "./nowhere"), "there is no such folder"),
        ("nieh_gt", ("--retriever", "./nowhere"), "no context of nieh_gt retrieves frames"),
    ):
        assert_refused(run_cli(*arguments, "--tasks", tasks, *options), *expected)
    assert not (tmp_path / "out").exists()


def test_trajectories_are_read_from_the_folder_that_is_named(data, tmp_path, run_cli):
    folder, out = tmp_path / "trajectories", tmp_path / "out"
    folder.mkdir()
    actions = [{"api_action": {"action": "PickupObject", "objectId": "Mug|1|2|3"}}]
    trajectory = {"plan": {"low_actions": actions}, "sub_tasks": [{"task_desc": "get a mug"}]}
    trajectory |= {
        "sub_trajs": [{"low_pddl_idx": [0, 1]}],
        "state_summary": {"0": "a mug in the hand"},
    }
    for traj_id in ("traj_a", "traj_b"):
        (folder / f"{traj_id}.json").write_text(json.dumps(trajectory))
        log = {"images": [{"low_idx": 0, "image_name": "000000007.png"}]}
        (data / "metadata" / traj_id / "expert_log.json").write_text(json.dumps(log))
    arguments = option_words(
        model="qwen2.5-vl-tiny", tasks="nieh_interleaved,nieh_text_state", data=data
    )
    read_success(run_cli(*arguments, "--out", out, "--trajectories", folder))
    assert [doc["frames"] for doc in docs(out, "nieh_interleaved")] == [[0, 7]] * 6
    assert [doc["frames"] for doc in docs(out, "nieh_text_state")] == [[44]] * 6
    elsewhere = "no such folder; give the folder of the trajectories with --traj"
    for tasks, trajectories, expected in (
        ("nieh_gt", folder, "no context of nieh_gt tells of the trajectory"),
        ("nieh_interleaved", tmp_path / "no", elsewhere),
    ):
        words = option_words(model="oracle", tasks=tasks, data=data, trajectories=trajectories)
        assert_refused(run_cli(*words), expected)


def test_videos_are_shown_where_they_are_and_a_broken_one_is_counted(
    data, write_video, tmp_path, run_cli
):
    metadata, out = data / "metadata", tmp_path / "out"
    write_video(metadata / "traj_a" / "traj_a_10fps.mp4", range(0, 250, 10))
    (metadata / "traj_b" / "traj_b_10fps.mp4").write_bytes(b"no video")
    arguments = option_words(model="qwen2.5-vl-tiny", tasks="nieh_video", data=data, out=out)
    _, err = read_success(run_cli(*arguments))
    assert "nieh_video: 3 sample(s) skipped: " in err
    assert "traj_b_10fps.mp4: not a video that OpenCV can decode" in err
    summary = json.loads(find_one(out, "results.json").read_text())["summary"]
    task = summary["tasks"]["nieh_video"]
    assert (task["n"], task["skipped"]["n"]) == (3, 3)
    assert list(task["by_variant"]) == ["source=mp4"]
    assert [len(doc["frames"]) for doc in docs(out, "nieh_video")] == [4] * 3
    assert "; the film is given as a video" in err
    (metadata / "traj_b" / "traj_b_10fps.mp4").unlink()
    assert run_cli(*arguments)[0] == 0
    summaries = [json.loads(path.read_text())["summary"] for path in out.rglob("results.json")]
    variants = [summary["tasks"]["nieh_video"]["by_variant"] for summary in summaries]
    assert sorted(map(sorted, variants)) == [["source=frames", "source=mp4"], ["source=mp4"]]


@pytest.mark.parametrize(
    ("model", "film", "placeholder", "expected"),
    [
        ("qwen2.5-vl-tiny", "video", "<video>", "the film is given as a video"),
        ("llava-onevision-tiny", "video", "<video>", "the film is given as a video"),
        (
            "pixtral-tiny",
            "images",
            "<image>" * 4,
            "pixtral-tiny has no video input, the film is given as images",
        ),
    ],
)
def test_a_film_is_a_video_where_a_family_takes_it_and_the_run_says_so(
    data, tmp_path, run_cli, model, film, placeholder, expected
):
    out = tmp_path / "out"
    words = option_words(model=model, tasks="nieh_video", data=data, out=out, limit=1)
    _, err = read_success(run_cli(*words))
    assert expected in err
    (folder,) = {path.parent for path in out.rglob("results.json")}
    assert read_header(folder).config.tasks["nieh_video"]["film"] == film
    sample = json.loads(find_one(out, "samples_nieh_video_*.jsonl").read_text())
    assert sample["arguments"]["gen_args_0"]["arg_0"].startswith(
        f"{placeholder}\nAnswer the question given the video"
    )


def test_a_run_killed_while_it_takes_notes_ends_as_an_undisturbed_one(data, tmp_path):
    def start(output):
        arguments = option_words(
            model="qwen2.5-vl-tiny", tasks="nieh_memory_notes", data=data, out=output
        )
        return start_cli(*arguments)

    killed = start(tmp_path / "killed")
    wait_until(lambda: count_records(tmp_path / "killed", "nieh_note") >= 2, killed)
    os.kill(killed.pid, signal.SIGKILL)
    killed.communicate()
    assert (
        count_records(tmp_path / "killed", "nieh_note") < 6
    )  # three windows of twenty frames in each of two trajectories

    for name in ("killed", "whole"):
        finish(start(tmp_path / name))
    kinds = ("nieh_note", "request", "artifact")
    n_notes, n_requests, n_artifacts = (count_records(tmp_path / "killed", kind) for kind in kinds)
    assert n_notes == 6
    assert n_artifacts == 6 + n_requests + 6  # and what was recalled for each question
    results = [
        find_one(tmp_path / name, "results.json").read_bytes() for name in ("killed", "whole")
    ]
    assert results[0] == results[1]
    records = [read_records(tmp_path / name) for name in ("killed", "whole")]
    assert [r.fingerprint for r in records[0]] == [r.fingerprint for r in records[1]]
