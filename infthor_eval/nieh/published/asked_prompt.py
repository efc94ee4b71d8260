"""The prompt of a published log, from the tokens of its requests as Qwen2.5-VL counts them.

A request is frames, the chat template, the words of a prompt, and the question. The tokens of all
but the question are known; the question has at least one for each word and one for its mark. So
what is left over is how often its words were split: 0 to 4 times in each of the 1,303 published
questions. The two prompts of frames are 8 tokens apart, hence each row fits one of them at most,
without the model's vocabulary.
"""

from collections.abc import Iterable, Mapping

from infthor_eval.formats.replies.logged import LoggedReply
from infthor_eval.nieh.prompts import PUBLISHED_LOGS, PUBLISHED_MAIN

_PER_FRAME = 123  # of 300x300 pixels: 121 and two marks
_PER_PAIR = 144  # of two frames of a film; beside them two marks a request
_MARKS = 2
# Tokens of the chat template and the prompt's own words, by prompt;
# tests/nieh/published/test_asked_prompt.py counts them with the public vocabulary.
_OF_FRAMES = {PUBLISHED_MAIN: 52, PUBLISHED_LOGS: 60}
_OF_FILMS = {PUBLISHED_MAIN: 54}
_MOST_SPLITS = 7  # the prompts' distance less one


def asked_prompt(replies: Iterable[LoggedReply]) -> str | None:
    """Return the prompt that fits every row; None if none does, or if a row does not tell."""
    fitting = [_fitting(reply) for reply in replies if reply.published]
    prompts = set(fitting)
    return prompts.pop() if len(prompts) == 1 else None


def _fitting(reply: LoggedReply) -> str | None:
    if reply.published is None or reply.n_context_tokens is None:
        return None
    known: Mapping[str, int]
    # Rows of videos do not count frames, and no text is as long as a pair of them.
    if reply.mode == "video":
        n_text = reply.n_context_tokens % _PER_PAIR - _MARKS
        known = _OF_FILMS
    elif reply.n_frames is None:
        return None
    else:
        n_text = reply.n_context_tokens - _PER_FRAME * reply.n_frames
        known = _OF_FRAMES
    n_least = len(reply.published.text.split()) + 1
    return next(
        (prompt for prompt, n in known.items() if 0 <= n_text - n - n_least <= _MOST_SPLITS), None
    )
