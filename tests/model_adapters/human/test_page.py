"""A person's sessions, from the command to the journal: a browser answers by the page's own
controls."""

import json
import re
import subprocess
import time
import urllib.error
import urllib.request

import pytest

from infthor_eval.formats.question import Question
from infthor_eval.nieh.records import RECORDS
from infthor_eval.plans.records import RECORDS as PLAN_RECORDS
from infthor_eval.runs import read_run
from model_adapters.human.model import UNTIMED

from ...helpers.processes import cli_words
from ...helpers.trajectories import FORK, cut_trajectory, write_trajectories
from ...helpers.waiting import PATIENCE_S

HOSTILE = "Is </script><img src=x onerror='document.title=\"hacked\"'> here?"
KEY = ("yes", "no", "Fridge", "3", "SideTable, Desk")
# Ten questions on two trajectories, told apart by their texts.
QUESTIONS = tuple(
    Question(
        f"room-{number % 2}",
        HOSTILE if number == 9 else f"What is number {number}?",
        (1,),
        (KEY[number % 5],),
    )
    for number in range(10)
)
ANSWERS = {question.text: str(question.answers[0]) for question in QUESTIONS}


class Session:
    """A run of a person, and the tab that answers."""

    def __init__(self, browser, output, *words):
        model = () if "--model" in words else ("--model", "human:browser=false")
        self.process = subprocess.Popen(
            cli_words(*model, "--out", output, *words),
            stderr=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            text=True,
        )
        self.address = self._address()
        self.errors = []
        self.tab = self.new_tab(browser)

    def _address(self):
        assert self.process.stderr is not None
        for line in self.process.stderr:
            match = re.search(r"human: answer at (http://\S+)", line)
            if match:
                return match[1]
        pytest.fail("the run ended without a page")

    def new_tab(self, browser, slow_s=0.0):
        """Open the page in a tab, which gets the first frame so many seconds late."""
        tab = browser.new_page(viewport={"width": 1280, "height": 900})
        # A simulator that starts, or an action in it, can take more than the usual 30 s where the
        # machine is busy.
        tab.set_default_timeout(1000 * PATIENCE_S)
        tab.on("pageerror", lambda error: self.errors.append(str(error)))
        if slow_s:
            tab.route("**/frames/1/0", lambda route: (time.sleep(slow_s), route.continue_()))
        with tab.expect_response("**/screen"):  # what is asked is on the screen, and the run knows
            tab.goto(self.address)
        tab.locator("#desk").wait_for()
        return tab

    def await_answered(self, number):
        """Wait until so many are answered and the next one is shown, or that there is none."""
        self.tab.get_by_text(f"{number} answered in this sitting", exact=True).wait_for()
        self.tab.locator("#state:empty, #desk[hidden]").first.wait_for(state="attached")

    @property
    def question(self):
        return self.tab.locator("#question").inner_text().rpartition("Question: ")[2]

    def end(self):
        """Wait until the run ends, and return its exit code."""
        assert self.process.stderr is not None
        error_text = self.process.stderr.read()
        code = self.process.wait(60)
        assert "Traceback" not in error_text, error_text
        return code


@pytest.fixture
def session(browser, tmp_path):
    """Starts sessions; ends those that are left."""
    begun = []

    def begin(*words):
        begun.append(Session(browser, tmp_path / "out", *words))
        return begun[-1]

    yield begin
    for one in begun:
        one.process.kill()
        one.process.wait()
        one.tab.close()


@pytest.fixture
def data(make_nieh_set):
    return make_nieh_set(QUESTIONS, n_frames=12)


def records(tmp_path):
    (folder,) = (tmp_path / "out/human").iterdir()
    return read_run(folder, RECORDS)[1]


def by_text(tmp_path):
    return {record.payload.question: record.payload for record in records(tmp_path)}


def test_ten_questions_by_keyboard_alone(session, data, tmp_path):
    one = session("--tasks", "nieh_full", "--data", data)
    keyboard, unknown = one.tab.keyboard, ""
    for number in range(10):
        one.await_answered(number)
        question = one.question
        assert one.tab.locator("#place").inner_text() == "1 of 12"
        keyboard.press("Shift+ArrowRight")
        keyboard.press(".")
        assert one.tab.locator("#place").inner_text() == "12 of 12"
        one.tab.wait_for_timeout(150)  # for which a frame counts as looked at
        if number == 3:
            keyboard.press("n")
            unknown = question
            continue
        keyboard.press("Enter")
        keyboard.type(ANSWERS[question])
        keyboard.press("Enter")
    one.tab.get_by_text("All is answered. Thank you.").wait_for()
    assert one.end() == 0
    assert one.errors == []
    answers = by_text(tmp_path)
    assert {text: answer.reply for text, answer in answers.items()} == ANSWERS | {
        unknown: "I do not know"
    }
    assert all(answer.scores["strict"] == (text != unknown) for text, answer in answers.items())
    assert all(
        answer.n_watched is not None and 1 <= answer.n_watched <= 3 for answer in answers.values()
    )
    assert all(
        record.seconds >= 0.15 and record.tokens.context is None for record in records(tmp_path)
    )


def test_ten_questions_by_mouse(session, data, tmp_path):
    one = session("--tasks", "nieh_gt", "--data", data)
    for number in range(10):
        one.await_answered(number)
        question = one.question
        if question == HOSTILE:  # it is text, and no element of it is there
            assert one.tab.locator("img[src=x]").count() == 0
            one.tab.locator("#whole summary").click()
            assert HOSTILE in one.tab.locator("#parts").inner_text()
        one.tab.locator("#text").click()
        answer = ANSWERS[question]
        one.tab.locator("#text").fill(answer[:2].lower())
        word = one.tab.locator("#words li", has_text=re.compile(f"^{re.escape(answer)}$"))
        if word.count():
            word.click()
        else:
            one.tab.locator("#text").fill(answer)
        one.tab.locator("#send").click()
    one.tab.get_by_text("All is answered. Thank you.").wait_for()
    assert one.tab.title() == "infthor-eval: answer"
    assert one.end() == 0
    assert one.errors == []
    assert {text: answer.reply for text, answer in by_text(tmp_path).items()} == ANSWERS


def test_exactly_the_frames_are_shown_that_a_model_is_given(session, data):
    one = session("--tasks", "nieh_gt", "--data", data, "--frames", "blank")
    one.await_answered(0)
    assert one.tab.locator("#place").inner_text() == "1 of 1"  # the clue frame
    assert one.tab.locator("#parts li").count() == 2
    shade = one.tab.evaluate(
        """async () => {
            const image = document.getElementById("frame");
            await image.decode();
            const canvas = document.createElement("canvas"), pen = canvas.getContext("2d");
            pen.drawImage(image, 0, 0);
            return [image.naturalWidth, ...pen.getImageData(9, 9, 1, 1).data];
        }"""
    )
    width, red, green, blue, _ = shade
    assert width == 300 and red == green == blue


def test_two_tabs_answer_one_question_once(session, data, tmp_path, browser):
    one = session("--tasks", "nieh_gt", "--data", data, "--limit", 2)
    one.await_answered(0)
    other = one.new_tab(browser)
    # It does not learn that the question was answered.
    other.route("**/state.json*", lambda route: route.abort())
    first = one.question
    one.tab.locator("#text").fill("first")
    one.tab.keyboard.press("Enter")
    one.await_answered(1)
    other.evaluate("question = question || {number: 1, replies: []}")
    other.evaluate("send('second')")
    other.get_by_text("this question was answered already, perhaps in another tab").wait_for()
    one.tab.locator("#unknown").click()
    assert one.end() == 0
    other.close()
    assert by_text(tmp_path)[first].reply == "first"


def test_what_is_no_answer_is_refused_with_the_reason(session, data):
    one = session("--tasks", "nieh_gt", "--data", data, "--limit", 1)
    one.await_answered(0)
    one.tab.locator("#text").fill("   ")
    one.tab.keyboard.press("Enter")
    one.tab.get_by_text("write an answer first").wait_for()

    def post(path, body, **headers):
        request = urllib.request.Request(path, body, headers)
        try:
            with urllib.request.urlopen(request) as answer:
                return int(answer.status)
        except urllib.error.HTTPError as error:
            with error:
                return error.code

    reply = json.dumps({"number": 1, "text": "yes"}).encode()
    assert post(f"{one.address}answer", b"[]") == 400
    assert (
        post(f"{one.address}answer", json.dumps({"number": 1, "text": "a" * 2001}).encode()) == 400
    )
    assert post(f"{one.address}answer", reply, Origin="http://elsewhere.example") == 403
    token = one.address.rstrip("/").rpartition("/")[2]
    assert post(f"{one.address.replace(token, 'x' * len(token))}answer", reply) == 403
    assert one.question  # nobody has answered it
    assert post(f"{one.address}answer", reply) == 200
    assert one.end() == 0


def test_a_run_that_is_killed_goes_on_where_it_was(session, data, tmp_path):
    words = ("--tasks", "nieh_gt", "--data", data, "--limit", 3)
    one = session(*words)
    one.await_answered(0)
    first = one.question
    one.tab.locator("#text").fill("mine")
    one.tab.keyboard.press("Enter")
    one.await_answered(1)
    one.process.kill()
    one.tab.get_by_text("The run has stopped. All answers are kept").wait_for()
    again = session(*words)
    questions = []
    for number in range(2):
        again.await_answered(number)
        questions.append(again.question)
        again.tab.locator("#unknown").click()
    assert again.end() == 0
    assert first not in questions
    answers = by_text(tmp_path)
    assert {text: answer.reply for text, answer in answers.items()} == {
        first: "mine"
    } | dict.fromkeys(questions, "I do not know")


def test_a_run_is_stopped_from_the_page_by_keys_and_taken_up_again(session, data, tmp_path):
    words = ("--tasks", "nieh_gt", "--data", data, "--limit", 4)
    one = session(*words)
    one.await_answered(0)
    place = one.tab.locator("#unit")
    assert place.inner_text() == "question 1 of 4"
    one.tab.keyboard.press("n")
    one.await_answered(1)
    assert place.inner_text() == "question 2 of 4"
    one.tab.locator("#stop").focus()
    one.tab.keyboard.press("Enter")
    one.tab.get_by_text("Stopped.", exact=True).wait_for()
    assert one.tab.locator("#stop").is_hidden()  # it would do nothing any more
    assert one.end() == 130
    assert len(records(tmp_path)) == 1
    again = session(*words)
    for number in range(3):
        again.await_answered(number)
        assert again.tab.locator("#unit").inner_text() == f"question {number + 2} of 4"
        again.tab.keyboard.press("n")
    again.tab.get_by_text("All is answered. Thank you.").wait_for()
    assert again.tab.locator("#stop").is_hidden()
    assert again.end() == 0
    assert len(records(tmp_path)) == 4


def test_one_of_several_pages_cannot_stop_the_run(session, data):
    one = session("--tasks", "nieh_gt", "--data", data, "--workers", 2)
    one.await_answered(0)
    assert one.tab.locator("#stop").is_hidden()
    # It does not know how many the others have answered.
    assert one.tab.locator("#unit").inner_text() == ""


def test_the_clock_starts_when_the_frames_are_shown_and_stands_while_nobody_looks(
    session, data, tmp_path, browser
):
    before = time.monotonic()
    one = session("--tasks", "nieh_full", "--data", data, "--limit", 2)
    one.await_answered(0)
    one.tab.goto("about:blank")  # the person leaves the page
    one.tab.wait_for_timeout(2000)
    late = one.new_tab(browser, slow_s=1.0)  # and comes back, to a frame that takes so long
    late.route("**/screen", lambda route: route.abort())  # of the next question it tells nothing
    late.locator("#unknown").click()
    late.get_by_text("1 answered in this sitting").wait_for()
    took = time.monotonic() - before
    late.locator("#state:empty").wait_for(state="attached")
    late.locator("#unknown").click()
    late.get_by_text("All is answered. Thank you.").wait_for()
    late.close()
    assert one.end() == 0
    first, second = records(tmp_path)
    assert 0.0 < first.seconds < took - 3.0
    assert (first.faults, second.faults) == ((), (UNTIMED,))
    assert second.seconds > 0.0


def test_all_controls_are_reached_and_used_by_keys(session, data):
    one = session("--tasks", "nieh_full", "--data", data, "--limit", 1)
    one.await_answered(0)
    reached = set()
    for _ in range(20):
        one.tab.keyboard.press("Tab")
        reached.add(one.tab.evaluate("document.activeElement.id || document.activeElement.tagName"))
    controls = {"stop", "help", "play", "scrub", "speed", "text", "send", "unknown", "SUMMARY"}
    assert controls <= reached
    one.tab.locator("#whole summary").focus()
    one.tab.keyboard.press("Enter")
    assert one.tab.locator("#parts").is_visible()
    one.tab.keyboard.press("Space")
    assert one.tab.locator("#parts").is_hidden()
    one.tab.keyboard.press("?")
    assert one.tab.locator("#keys").is_visible()
    one.tab.keyboard.press("n")
    assert one.end() == 0


@pytest.mark.parametrize("by", ["keyboard", "mouse"])
def test_a_plan_is_acted_out(session, tmp_path, by):
    document = cut_trajectory(FORK, 1)
    data = write_trajectories(tmp_path / "data", document)
    one = session("--tasks", "infthor_plans", "--data", data)
    keys = {
        "MoveAhead": "ArrowUp",
        "RotateLeft": "ArrowLeft",
        "RotateRight": "ArrowRight",
        "LookUp": "PageUp",
    }
    keys["LookDown"] = "PageDown"
    actions = [low["api_action"]["action"] for low in document["plan"]["low_actions"]]
    assert (
        one.tab.locator("#title").inner_text()
        == f"Plan 1 of 1: {one.tab.locator('#title').inner_text()[13:]}"
    )
    assert "goal" in one.tab.locator("#facts").inner_text()
    for number, action in enumerate(actions, 1):
        if by == "keyboard":
            one.tab.keyboard.press(keys[action])
        else:
            one.tab.locator("#replies button", has_text=action).first.click()
        one.await_answered(number)
        if one.tab.locator("#desk").is_hidden():
            break  # the plan is done before its last actions
    one.tab.get_by_text("All is answered. Thank you.").wait_for()
    assert one.end() == 0
    assert one.errors == []
    (folder,) = (tmp_path / "out/human").iterdir()
    (record,) = read_run(folder, PLAN_RECORDS)[1]
    assert [step.action for step in record.payload.steps] == actions[:number]
    assert record.payload.done
    assert record.payload.reward == record.payload.max_reward > 0


def test_people_are_told_apart(session, data, tmp_path):
    words = cli_words("--model", "human:reader=../x", "--tasks", "nieh_gt", "--data", data)
    refused = subprocess.run(words, capture_output=True, text=True, check=False)
    assert refused.returncode == 2
    assert "reader=../x: give a name" in refused.stderr
    for reader in ("ann", "ben"):
        model = f"human:browser=false,reader={reader}"
        one = session("--model", model, "--tasks", "nieh_gt", "--data", data, "--limit", 1)
        one.await_answered(0)
        one.tab.locator("#unknown").click()
        assert one.end() == 0
    folders = list((tmp_path / "out/human").iterdir())
    assert {read_run(folder, RECORDS)[0].config.model["reader"] for folder in folders} == {
        "ann",
        "ben",
    }
