"""Replies are decoded as the task file says."""

import json

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.runs import execute

from .watching import replies

TINY = "qwen2.5-vl-tiny"


@pytest.fixture
def sampling(task_files):
    """Has `nieh_gt` decode as the given lines say."""

    def write(settings):
        (task_files / "nieh" / "nieh_gt.yaml").write_text(
            "include: _nieh.yaml\ntask: nieh_gt\ndataset_kwargs: {context: clues}\n"
            f"generation_kwargs: {{{settings}}}\n"
        )

    return write


def test_a_temperature_in_the_task_file_samples_and_the_seed_decides_what(
    prepare_run, sampling, tmp_path
):
    def reply_with(settings, folder="out"):
        sampling(settings)
        return replies(execute(prepare_run(TINY, tasks=("nieh_gt",), output=tmp_path / folder)))

    drawing = "max_gen_toks: 12, do_sample: true, temperature: 2.0"
    greedy = reply_with("max_gen_toks: 12, do_sample: false, temperature: 0.0")
    drawn = reply_with(drawing)
    assert drawn != greedy
    assert reply_with(drawing, folder="again") == drawn
    assert reply_with("max_gen_toks: 12, temperature: 2.0", folder="without the word") == drawn
    assert reply_with(f"{drawing}, top_p: 0.000001", folder="top") == greedy


def test_another_seed_draws_other_replies_from_the_same_weights(prepare_run, sampling, tmp_path):
    from model_adapters.tiny.qwen2_5_vl import save_tiny_checkpoint

    save_tiny_checkpoint(tmp_path / "checkpoint", seed=0)
    sampling("max_gen_toks: 12, do_sample: true, temperature: 2.0")
    options = {"pretrained": str(tmp_path / "checkpoint"), "device": "cpu"}
    first, second = (
        replies(execute(prepare_run("qwen2.5-vl", options, tasks=("nieh_gt",), seed=seed)))
        for seed in (0, 1)
    )
    assert first.keys() == second.keys()
    assert first != second


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ("do_sample: false, temperature: 0.7", "temperature 0.7 without do_sample has no effect"),
        ("do_sample: true, temperature: 0.0", "do_sample with temperature 0 contradict each other"),
        ("num_beams: 4", "num_beams is not known; there are until, max_gen_toks"),
        ("until: 5", "until is 5; it is a text or a list of texts"),
        ("until: {a: 1}", "until is {'a': 1}; it is a text or a list of texts"),
        ("until: [7]", r"until is \[7\]; it is a text or a list of texts"),
        ("do_sample: 'no'", "do_sample is 'no'; it is true or false"),
        ("temperature: -1.0", "temperature must be 0"),
        ("temperature: warm", "temperature is 'warm'; it is a number"),
        ("top_p: most", "top_p is 'most'; it is a number"),
        ("top_p: 1.5", "top_p must be above 0 and at most 1, not 1.5"),
        ("max_gen_toks: 0", "max_new_tokens must be at least 1, not 0"),
        ("max_gen_toks: many", "max_gen_toks is 'many'; it is a whole number"),
    ],
)
def test_settings_that_would_not_act_are_refused_before_a_model_is_loaded(
    prepare_run, sampling, settings, expected
):
    sampling(settings if "max_gen_toks" in settings else f"max_gen_toks: 12, {settings}")
    with pytest.raises(
        UsageError, match=rf"nieh_gt\.yaml: generation_kwargs: {expected}"
    ) as caught:
        prepare_run(TINY, tasks=("nieh_gt",))
    assert "\n" not in str(caught.value)


def test_a_stop_text_of_the_task_file_ends_replies(prepare_run, sampling):
    sampling("max_gen_toks: 12, until: []")
    whole = replies(execute(prepare_run(TINY, tasks=("nieh_gt",))))
    mark = next(text[1] for text in whole.values() if len(text) > 1)
    sampling(f"max_gen_toks: 12, until: {json.dumps([mark])}")
    assert replies(execute(prepare_run(TINY, tasks=("nieh_gt",)))) == {
        key: text.partition(mark)[0] for key, text in whole.items()
    }
