"""Prompts of NIEH in the words of the published evaluation, and what counts of a response.

To add or change the words of a question: here; which contexts take them is in
`contexts/__init__.py: CONTEXTS`.
"""

from infthor_eval.formats.question import Question

PUBLISHED_MAIN = "published-main"  # of the published branch main; the default
# Of the branch nieh_dev, with which the published image logs were asked.
PUBLISHED_LOGS = "published-logs"
PROMPTS = (PUBLISHED_MAIN, PUBLISHED_LOGS)

_INDENT = " " * 8
_VIEWS = "These images are the agent's view in time order. Answer the question given the images."
_FORM = "Do not include explanation or reasoning in the answer. Answer with a single word or words."


def question_text(intro: str, question: Question, prompt: str = PUBLISHED_MAIN) -> str:
    """Return the text after a context, from the line break that ends it.

    Args:
        intro: the context's first sentence, which the logs' prompt has in words of its own.
        question: the question.
        prompt: one of `PROMPTS`.
    """
    if prompt == PUBLISHED_LOGS:
        # The blanks are the published script's own indentation, which its text keeps.
        return "".join(f"\n{_INDENT}{line}" for line in (_VIEWS, _FORM, question.text, ""))
    return f"\n{intro} {_FORM}\nQuestion: {question.text}"


def last_line(response: str) -> str:
    """Return the part of a response that counts: its last line."""
    return response.strip().rpartition("\n")[2].strip()
