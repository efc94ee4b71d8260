"""Decoding settings from `generation_kwargs` of a task file, in lm-eval's words."""

from collections.abc import Mapping
from typing import Any

from infthor_eval.errors import UsageError
from model_adapters.protocols import Decoding

__all__ = ["decoding_of"]

_KNOWN = (
    "until",
    "max_gen_toks",
    "do_sample",
    "temperature",
    "top_p",
    "choices",
    "repetition_penalty",
)


def decoding_of(given: Mapping[str, Any], seed: int, place: str) -> Decoding:
    """Return the decoding that settings describe; a setting without effect is refused.

    Args:
        given: `generation_kwargs` of a task, or of a request of lm-eval's.
        seed: seed of the sampling.
        place: name of the task, for messages.

    Raises:
        UsageError: a setting is unknown, or contradicts another.
    """
    if not isinstance(given, Mapping):
        raise UsageError(
            f"{place}: generation_kwargs is {given!r:.60}; it is a mapping of settings"
        )
    unknown = sorted(set(given) - set(_KNOWN), key=str)
    if unknown:
        raise UsageError(
            f"{place}: generation_kwargs: {unknown[0]} is not known; there are {', '.join(_KNOWN)}"
        )
    limit = given.get("max_gen_toks")
    if not isinstance(limit, int) or isinstance(limit, bool):
        raise UsageError(
            f"{place}: generation_kwargs: max_gen_toks is {limit!r}; it is a whole number of tokens"
        )
    temperature = _temperature(given, place)
    top_p = _number(given.get("top_p", 1.0), "top_p", place)
    asked = given.get("repetition_penalty")
    penalty = None if asked is None else _number(asked, "repetition_penalty", place)
    stop, choices = (_texts(given.get(name, ()), name, place) for name in ("until", "choices"))
    try:
        return Decoding(
            max_new_tokens=limit,
            temperature=temperature,
            top_p=top_p,
            seed=seed,
            stop=stop,
            choices=choices,
            repetition_penalty=penalty,
        )
    except UsageError as error:
        raise UsageError(f"{place}: generation_kwargs: {error}") from error


def _temperature(given: Mapping[str, Any], place: str) -> float:
    """Return the temperature as lm-eval reads it: above 0 implies sampling, and sampling alone
    implies 1."""
    temperature = (
        None
        if given.get("temperature") is None
        else _number(given["temperature"], "temperature", place)
    )
    samples = given.get("do_sample", bool(temperature))
    if not isinstance(samples, bool):
        raise UsageError(
            f"{place}: generation_kwargs: do_sample is {samples!r}; it is true or false"
        )
    if samples and temperature == 0:
        raise UsageError(
            f"{place}: generation_kwargs: do_sample with temperature 0 contradict each other"
        )
    if not samples and temperature:
        raise UsageError(
            f"{place}: generation_kwargs: temperature {temperature} without do_sample has no effect"
        )
    return (1.0 if temperature is None else temperature) if samples else 0.0


def _number(given: Any, name: str, place: str) -> float:
    if not isinstance(given, int | float) or isinstance(given, bool):
        raise UsageError(f"{place}: generation_kwargs: {name} is {given!r}; it is a number")
    return float(given)


def _texts(given: object, name: str, place: str) -> tuple[str, ...]:
    if given is not None and not isinstance(given, str | list | tuple):
        raise UsageError(
            f"{place}: generation_kwargs: {name} is {given!r:.60}; it is a text or a list of texts"
        )
    texts = (given,) if isinstance(given, str) else tuple(given or ())
    if not all(isinstance(text, str) for text in texts):
        raise UsageError(
            f"{place}: generation_kwargs: {name} is {given!r}; it is a text or a list of texts"
        )
    return texts
