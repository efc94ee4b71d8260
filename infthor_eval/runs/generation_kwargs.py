"""Decoding settings from `generation_kwargs` of a task file, in lm-eval's words."""

from collections.abc import Mapping
from typing import Any

from infthor_eval.errors import UsageError
from model_adapters.protocols import Decoding

_KNOWN = (
    "until",
    "max_gen_toks",
    "do_sample",
    "temperature",
    "top_p",
    "choices",
    "repetition_penalty",
)


def decoding_of(settings: Mapping[str, Any], seed: int, task: str) -> Decoding:
    """Return the decoding that settings describe; a setting without effect is refused.

    Args:
        settings: `generation_kwargs` of a task, or of a request of lm-eval's.
        seed: seed of the sampling.
        task: name of the task, for messages.
    """
    if not isinstance(settings, Mapping):
        raise UsageError(
            f"{task}: generation_kwargs is {settings!r:.60}; it is a mapping of settings"
        )
    unknown = sorted(set(settings) - set(_KNOWN), key=str)
    if unknown:
        raise UsageError(
            f"{task}: generation_kwargs: {unknown[0]} is not known; there are {', '.join(_KNOWN)}"
        )
    limit = settings.get("max_gen_toks")
    if not isinstance(limit, int) or isinstance(limit, bool):
        raise UsageError(
            f"{task}: generation_kwargs: max_gen_toks is {limit!r}; it is a whole number of tokens"
        )
    temperature = _temperature(settings, task)
    top_p = _number(settings.get("top_p", 1.0), "top_p", task)
    setting = settings.get("repetition_penalty")
    penalty = None if setting is None else _number(setting, "repetition_penalty", task)
    stop = _texts(settings.get("until", ()), "until", task)
    choices = _texts(settings.get("choices", ()), "choices", task)
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
        raise UsageError(f"{task}: generation_kwargs: {error}") from error


def _temperature(settings: Mapping[str, Any], task: str) -> float:
    """Return the temperature as lm-eval does: above 0 implies sampling, which alone implies 1."""
    temperature = (
        None
        if settings.get("temperature") is None
        else _number(settings["temperature"], "temperature", task)
    )
    samples = settings.get("do_sample", bool(temperature))
    if not isinstance(samples, bool):
        raise UsageError(
            f"{task}: generation_kwargs: do_sample is {samples!r}; it is true or false"
        )
    if samples and temperature == 0:
        raise UsageError(
            f"{task}: generation_kwargs: do_sample with temperature 0 contradict each other"
        )
    if not samples and temperature:
        raise UsageError(
            f"{task}: generation_kwargs: temperature {temperature} without do_sample has no effect"
        )
    return (1.0 if temperature is None else temperature) if samples else 0.0


def _number(value: Any, name: str, task: str) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise UsageError(f"{task}: generation_kwargs: {name} is {value!r}; it is a number")
    return float(value)


def _texts(value: object, name: str, task: str) -> tuple[str, ...]:
    if value is not None and not isinstance(value, str | list | tuple):
        raise UsageError(
            f"{task}: generation_kwargs: {name} is {value!r:.60}; it is a text or a list of texts"
        )
    texts = (value,) if isinstance(value, str) else tuple(value or ())
    if not all(isinstance(text, str) for text in texts):
        raise UsageError(
            f"{task}: generation_kwargs: {name} is {value!r}; it is a text or a list of texts"
        )
    return texts
