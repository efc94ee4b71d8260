"""Generating, replaying and asking by several workers: the very files of one."""

from infthor_eval.storage.digests import digest_of_file

from ..helpers.command_line import option_words

SCENES = ("--scene", "kitchen-1,bedroom-2", "--min-steps", 20, "--min-subgoals", 1)


def files(folder):
    return {
        str(path.relative_to(folder)): digest_of_file(path)
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != "replay.json"  # which holds times
    }


def test_the_files_are_the_same_whoever_makes_them(run_cli, tmp_path):
    for workers in (1, 2):
        out = tmp_path / str(workers)
        code, output, err = run_cli(
            "generate", *SCENES, "--out", out / "made", "--workers", workers
        )
        assert code == 0, err
        assert output.startswith("2 trajectories (0 generated earlier)")
        assert run_cli("replay", out / "made", "--out", out / "set", "--workers", workers)[0] == 0
        assert (
            run_cli(
                "questions",
                out / "set",
                *option_words(out=out / "set" / "qa_set_q.csv", workers=workers),
            )[0]
            == 0
        )
    assert files(tmp_path / "1") == files(tmp_path / "2")
    assert len(files(tmp_path / "2")) > 40
    code, output, _ = run_cli("generate", *SCENES, "--out", tmp_path / "2" / "made", "--workers", 2)
    assert (code, output.splitlines()[0].split(",")[0]) == (
        0,
        "2 trajectories (2 generated earlier)",
    )


def test_gpus_are_shared_out_by_a_cluster_alone(run_cli, tmp_path):
    code, _, err = run_cli(
        "--model", "blind", "--tasks", "nieh_mini_gt", "--gpus-per-worker", 1, "--out", tmp_path
    )
    assert (code, "--gpus-per-worker is for --ray-address" in err) == (2, True)
