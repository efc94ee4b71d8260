"""Questions: how they are answered, whatever suite asks them, and suites that are no more than a
dataset and a scorer."""

from infthor_eval.questions.suite import Question, QuestionSuite

__all__ = ["Question", "QuestionSuite"]
