"""The published question files and logs, where they are beside the repository."""

from pathlib import Path
from typing import Any

import pytest

from infthor_eval.formats.question import Question

__all__ = ["PUBLISHED_SETS", "make_log_row", "needs_published_sets"]

PUBLISHED_SETS = Path(__file__).parents[2] / "../shared/data/published_sets"
needs_published_sets = pytest.mark.skipif(
    not PUBLISHED_SETS.is_dir(), reason="the published sets are not at ../shared/data"
)


def make_log_row(number: int, question: Question, reply: str, **more: Any) -> dict[str, Any]:
    """A reply to the question of that number in its file, as the published scripts log it."""
    return {
        "qidx": number,
        "traj_id": question.traj_id,
        "question": question.text,
        "gt_img_idx": list(question.clues),
        "gt_answer": list(question.answers),
        "llm_response": reply,
        **more,
    }
