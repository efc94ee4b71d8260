"""What a model claims to be able to do: it does it, or refuses it."""

from concurrent.futures import ThreadPoolExecutor

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.check.asking import NEW_TOKENS, QUESTION, ask, opened, same
from model_adapters.check.clauses import raises, require
from model_adapters.protocols import Decoding, Model, Reply

__all__ = ["check_choices", "check_flight", "check_sampling"]

_THREADS = 4  # of those that a model takes, so many are tried
_CHOICES = ("bright", "dark", "dark and bright")  # one begins like another


def check_sampling(model: Model, frame: FrameRef) -> None:
    """Check that replies are drawn where the model says so, by the seed alone where it is deterministic.

    Raises:
        ContractError: names the clause that does not hold.
    """
    drawn = [Decoding(max_new_tokens=NEW_TOKENS, temperature=2.0, seed=seed) for seed in range(4)]
    talk = opened(model, frame, "\nDescribe the picture.")
    if not model.capabilities.sampling:
        require(raises(ModelError, talk.reply, drawn[0]), "a temperature that is not taken does not raise ModelError")
        return
    replies = [talk.reply(decoding) for decoding in drawn]
    require(any(not same(replies[0], other) for other in replies), "no seed changes a reply at temperature 2")
    if model.capabilities.deterministic:
        again = [talk.reply(decoding) for decoding in reversed(drawn)][::-1]
        require(all(map(same, replies, again)), "the same seed does not draw the same reply")


def check_choices(model: Model, frame: FrameRef) -> None:
    """Check that replies are held to choices where the model says so.

    Raises:
        ContractError: names the clause that does not hold.
    """
    decoding = Decoding(max_new_tokens=64, choices=_CHOICES)
    talk = opened(model, frame, QUESTION)
    if not model.capabilities.choices:
        require(raises(ModelError, talk.reply, decoding), "choices that are not taken do not raise ModelError")
        return
    for chosen in (_CHOICES, _CHOICES[1:], _CHOICES[:1]):
        text = talk.reply(Decoding(max_new_tokens=64, choices=chosen)).text
        require(text in chosen, f"a reply is none of its choices: {text!r}")


def check_flight(model: Model, black: FrameRef, white: FrameRef) -> None:
    """Check that several conversations can be asked at the same time, where the model says so.

    Raises:
        ContractError: a reply differs from that of asking one by one.
    """
    n_threads = min(model.capabilities.max_in_flight, _THREADS)
    if n_threads == 1:
        return
    asked = [(frame, f"\nWhat is picture {number}?") for number in range(n_threads) for frame in (black, white)]

    def answer(parts: tuple[FrameRef, str]) -> Reply:
        return ask(model, *parts)

    with ThreadPoolExecutor(n_threads) as pool:
        together = list(pool.map(answer, asked))
    alike = not model.capabilities.deterministic or all(map(same, together, map(answer, asked)))
    require(alike, "replies that are asked for at the same time differ from those one by one")
