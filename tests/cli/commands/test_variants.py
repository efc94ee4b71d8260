"""One model with several options: a run and a row for each, labelled by what differs."""

from ...helpers.command_line import option_words, read_success


def test_each_variant_has_a_folder_and_a_label(make_nieh_set, tmp_path, run_cli, monkeypatch):
    models = "qwen2.5-vl-tiny:max_tokens=3000,qwen2.5-vl-tiny:max_tokens=4000,oracle"
    data, out = make_nieh_set(size=56), tmp_path / "out"
    words = option_words(model=models, tasks="nieh_gt", data=data, limit=1, out=out)
    printed, err = read_success(run_cli(*words))
    folders = sorted((out / "qwen2.5-vl-tiny").iterdir())
    assert len(folders) == 2
    assert err.count("qwen2.5-vl-tiny: random weights") == 1
    table, as_csv = (run_cli("show", *folders, *form)[1] for form in ((), ("--format", "csv")))
    monkeypatch.chdir(tmp_path)  # a long path would wrap the lines
    _, listed, _ = run_cli("ls", "runs", "out")
    for text in (printed, table, as_csv, listed):
        for n_tokens in (3000, 4000):
            label = f"qwen2.5-vl-tiny (max_tokens={n_tokens})"
            assert any(label in line for line in text.splitlines() if "nieh_gt" in line)
    assert "oracle (" not in printed
