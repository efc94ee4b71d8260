"""`table final`: what is printed, and what is said of a log that is damaged."""

import json

from ...helpers.command_line import assert_refused

ROW = {
    "total_count": 4, "success_count": 1, "goto_count": 2, "goto_success": 1, "pick_count": 1,
    "pick_success": 0,
    "put_count": 1, "put_success": 0,
}  # fmt: skip
LOG = "eval_longhrz_checkpoints_infini-ft_step-20000-hf.log"


def test_the_table_is_printed_and_bad_lines_are_named(tmp_path, run_cli):
    path = tmp_path / LOG
    path.write_text(
        "".join(json.dumps({"traj_id": name, "metric": ROW}) + "\n" for name in ("t0", "t1"))
    )
    code, out, err = run_cli("table", "final", path)
    assert (code, err) == (0, "")
    assert "25.0 (2 of 8)" in out
    assert "printed cells follow from these logs" in out
    path.write_text(path.read_text() + "half a\n" * 5)
    code, out, err = run_cli("table", "final", path)
    assert (code, "25.0 (2 of 8)" in out) == (1, True)
    assert f"{LOG}: 5 row(s) not read" in err
    assert f"{LOG}, line 3: has no counts of plans (" in err
    assert "and 2 more in 1 log(s)" in err


def test_a_log_of_replies_is_one_line(tmp_path, run_cli):
    path = tmp_path / "eval_qa_set.log"
    path.write_text('{"qidx": 0, "llm_response": "yes"}\n')
    assert_refused(run_cli("table", "final", path), "no line has counts of plans")
