"""One model with several options: a run and a row for each, labelled by what differs."""

import pytest


@pytest.fixture
def variants(make_nieh_set, tmp_path, run_cli):
    """The output of a command with two variants of a model, and the folders of their runs."""
    models = "qwen2.5-vl-tiny:max_tokens=3000,qwen2.5-vl-tiny:max_tokens=4000,oracle"
    data, out = make_nieh_set(size=56), tmp_path / "out"
    code, printed, err = run_cli(
        "--model", models, "--tasks", "nieh_gt", "--data", data, "--limit", 1, "--out", out
    )
    assert code == 0, err
    return printed, err, sorted((out / "qwen2.5-vl-tiny").iterdir())


def test_each_variant_has_a_folder_and_a_label(variants, run_cli, tmp_path, monkeypatch):
    printed, err, folders = variants
    labels = ("qwen2.5-vl-tiny (max_tokens=3000)", "qwen2.5-vl-tiny (max_tokens=4000)")
    assert len(folders) == 2
    assert err.count("qwen2.5-vl-tiny: random weights") == 1
    _, table, _ = run_cli("show", *folders)
    monkeypatch.chdir(tmp_path)  # a long path would wrap the lines
    _, listed, _ = run_cli("ls", "runs", "out")
    for text in (printed, table, listed):
        for label in labels:
            assert any(label in line for line in text.splitlines() if "nieh_gt" in line)
    assert "oracle (" not in printed


def test_csv_has_the_labels_too(variants, run_cli):
    _, _, folders = variants
    _, table, _ = run_cli("show", *folders, "--format", "csv")
    assert "qwen2.5-vl-tiny (max_tokens=3000)" in table
