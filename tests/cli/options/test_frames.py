"""`--frames`: the same requests with other frames."""

import json

from ...helpers.command_line import read_success
from ...helpers.journals import read_records

TINY = "qwen2.5-vl-tiny"


def results(folder):
    documents = [json.loads(path.read_text()) for path in folder.rglob("results.json")]
    return {document["config"]["frames"]: document for document in documents}


def tokens(folder):
    tokens = {}
    for path in folder.rglob("journal"):
        for record in read_records(path.parent):
            tokens.setdefault(record.key, set()).add(record.tokens.context)
    return tokens


def test_a_run_with_each_and_the_gain_between_them(make_nieh_set, tmp_path, run_cli):
    data, out = make_nieh_set(size=56), tmp_path / "out"
    arguments = ["--model", TINY, "--tasks", "nieh_full", "--data", data, "--out", out]
    output, _ = read_success(run_cli(*arguments, "--frames", "shown,blank,shuffled,other"))
    assert results(out).keys() == {"shown", "blank", "shuffled", "other"}
    # Blanks cost as much.
    assert all(len(counts) == 1 for counts in tokens(out).values())
    rows = [line.split() for line in output.splitlines()]
    assert [TINY + ",", "blank", "frames", "nieh_full"] in [row[:4] for row in rows]
    assert "Gain over the same model's run on blank frames, in points" in output
    _, output, err = run_cli(*arguments)
    # The run on true frames is the one without the option.
    assert "0 evaluated now, 5 resumed" in err
    assert "Gain over" not in output
