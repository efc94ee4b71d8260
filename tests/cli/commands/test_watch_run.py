"""`watch-run`: prints the address of a page, and ends on Ctrl-C; the run is as it was."""

import json
import signal
import subprocess
import sys
import urllib.error
import urllib.request

import pytest

from infthor_eval.nieh.records import RECORDS
from infthor_eval.runs.journals.journal import Journal
from tests.helpers.command_line import assert_refused
from tests.helpers.nieh_runs import make_record
from tests.report.live.conftest import header_of

pytest.importorskip(
    "uvicorn", reason="the extra `page` is not installed: pip install 'infthor-eval[page]'"
)

# Where the tests run in the background of a shell, what they start would ignore Ctrl-C.
OURS = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from infthor_eval.cli import main
main()
"""


def test_the_page_is_served_until_ctrl_c_while_the_run_goes_on(tmp_path):
    words = [sys.executable, "-c", OURS, "watch-run", str(tmp_path)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        place, _, address = process.stdout.readline().strip().partition(": ")
        assert place == str(tmp_path)
        with Journal(tmp_path / "m" / "nieh-1", header_of(), RECORDS) as journal:
            journal.append(make_record(0, "Sofa", ("Sofa",)))
            with urllib.request.urlopen(f"{address}state.json", timeout=600) as answer:
                state = json.load(answer)
            journal.append(make_record(1, "Bed", ("Sofa",)))
        assert (state["totals"]["n_done"], state["n_units"]) == (1, 8)
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(address.rpartition("/")[0][:-1] + "/", timeout=600)
    finally:
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=600)
    assert (process.returncode, out, err) == (0, "", "")


def test_a_file_is_no_folder_of_runs(run_cli, tmp_path):
    (tmp_path / "file").write_text("")
    assert_refused(
        run_cli("watch-run", tmp_path / "file"),
        "is a file; give the folder of a run, or one above it",
    )


def test_without_the_extra_it_says_how_to_install_it(run_cli, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    assert_refused(run_cli("watch-run", tmp_path), "pip install 'infthor-eval[page]'")
