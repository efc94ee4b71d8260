"""A suite for infthor-eval: models add two numbers."""

import random
import re

from infthor_eval.questions import Question, QuestionSuite

__all__ = ["SUMS"]


def sums(below: int, n: int, seed: str) -> list[Question]:
    """Draw n different sums of two numbers: the same ones in every run."""
    pairs = [(a, b) for a in range(below) for b in range(below)]
    return [
        Question(
            id=f"{a}+{b}",
            text=f"What is {a} + {b}? Answer with a number.",
            answer=str(a + b),
            kind="with carry" if a % 10 + b % 10 >= 10 else "without carry",
            cluster=f"{a}+",  # right or wrong together: intervals take that into account
        )
        for a, b in sorted(random.Random(seed).sample(pairs, n))
    ]


def right(reply: str, question: Question) -> bool:
    """Return whether the first number of a reply is the sum."""
    number = re.search(r"-?\d+", reply)
    return number is not None and int(number[0]) == int(question.answer)


def calculator(question: Question) -> str:
    """Reply without a model: a baseline that is always right."""
    return question.answer


SUMS = QuestionSuite("sums", sums, right, baselines={"calculator": calculator})
