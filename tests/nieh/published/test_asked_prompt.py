"""With which prompt the published logs were asked, by the public vocabulary and without it."""

import base64
import importlib.util
import json
import os
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest
import regex

from infthor_eval.formats.replies.logged import LoggedReply
from infthor_eval.formats.replies.logs import read_reply_log
from infthor_eval.nieh.contexts import CONTEXTS
from infthor_eval.nieh.prompts import PUBLISHED_LOGS, PUBLISHED_MAIN, question_text
from infthor_eval.nieh.published import imported_replies as module
from infthor_eval.nieh.published.imported_replies import asked_prompt

from ...helpers.files import read_json_lines
from ...helpers.published import PUBLISHED_SETS, needs_published_sets
from ...helpers.questions import make_question

GOLDEN = json.loads((Path(__file__).parents[2] / "goldens" / "prompts.json").read_text())
REPLIES = PUBLISHED_SETS / "replies"


def vocabulary() -> Path:
    """Qwen's vocabulary: the file that QWEN_VOCABULARY names, or that of the package `dashscope`,
    if there is one."""
    package = importlib.util.find_spec("dashscope")
    folder = (
        Path(package.origin).parent
        if package is not None and package.origin is not None
        else Path()
    )
    return Path(os.environ.get("QWEN_VOCABULARY", folder / "resources" / "qwen.tiktoken"))


VOCABULARY = vocabulary()
needs_vocabulary = pytest.mark.skipif(
    not VOCABULARY.is_file(), reason="neither QWEN_VOCABULARY nor the package dashscope"
)
VIEWS, FILM = CONTEXTS["trajectory"].intro, CONTEXTS["video"].intro

# Qwen2's split of a text into pieces that are merged apart.
PIECES = regex.compile(
    r"(?i:'s|'t|'re|'ve|'m|'ll|'d)|[^\r\n\p{L}\p{N}]?\p{L}+|\p{N}"
    r"| ?[^\s\p{L}\p{N}]+[\r\n]*|\s*[\r\n]+|\s+(?!\S)|\s+"
)
# Between 5 special tokens.
TEMPLATE = ("system\nYou are a helpful assistant.", "\n", "user\n", "\n", "assistant\n")
N_SPECIAL = 5


@cache
def ranks():
    lines = (line.split() for line in VOCABULARY.read_bytes().splitlines())
    return {base64.b64decode(token): int(rank) for token, rank in lines}


@cache
def n_tokens_of_piece(piece):
    """Tokens of a piece by byte-pair encoding, the pair of the lowest rank first."""
    parts = [bytes([byte]) for byte in piece.encode()]
    while len(parts) > 1:
        joined = [ranks().get(left + right, float("inf")) for left, right in pairwise(parts)]
        place = min(range(len(joined)), key=joined.__getitem__)
        if joined[place] == float("inf"):
            break
        parts[place : place + 2] = [parts[place] + parts[place + 1]]
    return len(parts)


def n_tokens(text):
    """Tokens of a request's text, with those of the chat template."""
    return N_SPECIAL + sum(
        n_tokens_of_piece(piece) for part in (*TEMPLATE, text) for piece in PIECES.findall(part)
    )


@pytest.mark.parametrize("case", GOLDEN["published-logs"], ids=lambda case: case["question"])
def test_the_logs_prompt_is_the_published_text(case):
    assert (
        question_text(VIEWS, make_question("t", case["question"]), PUBLISHED_LOGS) == case["text"]
    )


@pytest.mark.parametrize("case", GOLDEN["published-main"], ids=lambda case: case["mode"])
def test_the_prompt_of_main_is_the_published_text(case):
    context = CONTEXTS[{"full_traj": "trajectory"}.get(case["mode"], case["mode"])]
    assert question_text(context.intro, make_question("t", case["question"])) == case["text"]


@needs_published_sets
@needs_vocabulary
def test_the_logs_prompt_has_the_logged_number_of_tokens_in_every_row():
    n = {PUBLISHED_LOGS: 0, PUBLISHED_MAIN: 0}
    n_rows = 0
    for row in [row for log in REPLIES.glob("*.log.gz") for row in read_json_lines(log)]:
        n_rows += 1
        n_text = row["ctx_n_tokens"] - 123 * row["n_imgs"]
        for prompt in n:
            n[prompt] += (
                n_tokens(question_text(VIEWS, make_question("t", row["question"]), prompt))
                == n_text
            )
    # All fourteen logs, by hand: 6,133 of 6,133 rows on images; 2,606 of 2,606 on videos are main's
    # prompt of films.
    assert (n_rows, n) == (3909, {PUBLISHED_LOGS: 3909, PUBLISHED_MAIN: 0})


@needs_vocabulary
def test_the_tokens_of_the_prompts_own_words_are_those_of_the_vocabulary():
    question = "Where is Statue now?"  # a token for each word and for the mark
    n_question = len(question.split()) + 1
    of_frames = {
        name: n_tokens(question_text(VIEWS, make_question("t", question), name))
        for name in module._OF_FRAMES
    }
    of_films = {
        name: n_tokens(question_text(FILM, make_question("t", question), name))
        for name in module._OF_FILMS
    }
    assert {name: n - n_question for name, n in of_frames.items()} == module._OF_FRAMES
    assert {name: n - n_question for name, n in of_films.items()} == module._OF_FILMS


@needs_published_sets
def test_each_published_log_tells_its_prompt_without_the_vocabulary():
    logs = sorted(REPLIES.glob("*.log.gz"))
    assert len(logs) == 6
    assert {asked_prompt(list(read_reply_log(log))) for log in logs} == {PUBLISHED_LOGS}


def reply(n_context_tokens, n_frames=10, mode="full_traj"):
    return LoggedReply(
        1,
        "yes",
        published=make_question("t", "Where is Statue now?"),
        mode=mode,
        n_frames=n_frames,
        n_context_tokens=n_context_tokens,
    )


# The first row of the published logs on images and on videos (1 and 2 frames per second): 886
# frames, "Where is Statue now?"; by hand, 57 tokens for main's prompt.
@pytest.mark.parametrize(
    ("replies", "prompt"),
    [
        ([reply(109043, 886)], PUBLISHED_LOGS),
        ([reply(123 * 886 + 57, 886)], PUBLISHED_MAIN),
        ([reply(6397, 0, "video"), reply(12733, 0, "video")], PUBLISHED_MAIN),
        ([reply(109043, 886), reply(123 * 886 + 57, 886)], None),
        ([reply(1485 * 10 + 65)], None),
        ([reply(None)], None),
        ([reply(1295, None)], None),
        ([], None),
    ],
)
def test_rows_tell_the_prompt_only_if_all_fit_one(replies, prompt):
    assert asked_prompt(replies) == prompt
