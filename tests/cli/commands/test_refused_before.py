"""What one of several runs cannot do is told before any of them has begun."""

import pytest

from infthor_eval.storage.folders import packaged_folder

from ...helpers.command_line import assert_refused, option_words

FUNCTIONS = """
def answer(images, text):
    return "yes"

def act(image, instruction):
    return [0, 0, 0, 0, 0, 0, 1]
"""
DRAWS = "answer draws no replies, as infthor_plans_mini does at temperature 1; add --greedy"
NO_TOKENS = "answer counts no tokens; take --history full, or leave out the budget"
NO_REPEATS = "answer draws no replies; leave it out, or give another model"
# By models and tasks, where "mine" stands for the file of functions: more words, and the reason.
REFUSED = {
    ("random,mine:answer", "infthor_plans_mini"): {
        "--constrained --greedy": "--constrained: answer cannot be held to choices; leave it out",
        "": DRAWS,
        "--greedy --history last:500": f"--history last:N: {NO_TOKENS}",
        "--greedy --history memory --memory last --budget 500": f"--budget: {NO_TOKENS}",
    },
    ("mine:answer", "nieh_mini_gt,infthor_plans_mini"): {"": DRAWS},
    ("oracle,mine:answer", "nieh_mini_gt"): {
        "--repeats 2": f"--repeats: {NO_REPEATS}",
        "--temperature 1": f"--temperature: {NO_REPEATS}",
        "--repeats 2 --workers 2": f"--repeats: {NO_REPEATS}",
    },
    ("oracle,mine:answer", "choosing"): {
        "": "choosing: answer does not support choices (2 given); ask without choices",
    },
    ("oracle,mine:answer", "nieh_mini_memory"): {
        "--memory last --budget 500": "the context has a size in tokens, which answer does not "
        "count; give --tokens-per-frame",
    },
    ("oracle,mine:act", "nieh_mini_gt"): {
        "": "mine.py:act cannot be evaluated on nieh, which needs a model that answers in words",
    },
    ("still,mine:answer", "manipulathor_mini"): {
        "": "mine.py:answer cannot be evaluated on manipulation, which needs a policy that drives "
        "an arm (openvla, spatialvla, ...)",
    },
    ("oracle,hf-vlm:pretrained=./nowhere", "nieh_mini_gt"): {"": "./nowhere"},
    ("oracle,anthropic:model=m", "nieh_mini_gt"): {"": "ANTHROPIC_API_KEY"},
}
CASES = [
    (*run, words, reason) for run, refusals in REFUSED.items() for words, reason in refusals.items()
]


@pytest.fixture
def refuse(run_cli, tmp_path, monkeypatch):
    """Runs models that one of them refuses; asserts that nothing was begun."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("ANTHROPIC_API_KEY", raising=False)
    (tmp_path / "mine.py").write_text(FUNCTIONS)
    (tmp_path / "tasks").mkdir()
    packaged = packaged_folder("tasks") / "nieh" / "nieh_mini_gt.yaml"
    choices = "generation_kwargs:\n  choices: ['yes', 'no']\n  max_gen_toks: 8\n"
    (tmp_path / "tasks" / "choosing.yaml").write_text(
        f"include: {packaged}\ntask: choosing\n{choices}"
    )

    def refuse(models, tasks, reason, *words):
        models = models.replace("mine:", "./mine.py:")
        given = option_words(model=models, tasks=tasks, include_path="tasks", out="out")
        assert_refused(run_cli(*words[:1], *given, *words[1:]), reason)
        assert not list((tmp_path / "out").rglob("journal"))

    return refuse


@pytest.mark.parametrize(("models", "tasks", "words", "reason"), CASES)
def test_a_later_run_is_refused_before_the_first_has_begun(refuse, models, tasks, words, reason):
    refuse(models, tasks, reason, "run", *words.split())


@pytest.mark.parametrize(
    "command, more, model, reason",
    [
        ("plan", (), "mine:answer", "--repeats: answer draws no replies"),
        ("run", ("--check-equality", 2), "hf-vlm:pretrained=./nowhere,batch_size=2", "./nowhere"),
    ],
)
def test_nothing_is_measured_or_compared_before_either(refuse, command, more, model, reason):
    models = f"qwen2.5-vl-tiny:batch_size=2,{model}"
    refuse(models, "nieh_mini_gt", reason, command, "--repeats", 2, *more)
