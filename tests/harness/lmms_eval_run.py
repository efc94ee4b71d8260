"""Runs lmms-eval itself on our tasks, with models that give known replies: REPLIES OUT.

In a process of its own, with lmms-eval on its path: `test_lmms.py` starts it.
"""

import json
import sys
from pathlib import Path

from lmms_eval.api.model import lmms
from lmms_eval.evaluator import simple_evaluate
from lmms_eval.tasks import TaskManager

from infthor_eval.harness.lmms import PATH

TASK = "infthor_twins_gt"


class Says(lmms):
    """A chat model whose replies are known; it keeps what it was asked."""

    is_simple = False

    def __init__(self, replies):
        super().__init__()
        self.replies = replies
        self.asked = {}

    def generate_until(self, requests):
        return [self._reply(*request.args) for request in requests]

    def _reply(self, context, to_messages, decoding, doc_id, task, split):
        doc = self.task_dict[task][split][doc_id]
        (message,) = to_messages(doc)
        *images, text = message["content"]
        assert {it["type"] for it in images} == {"image"}
        assert {it["url"].mode for it in images} == {"RGB"}
        assert (decoding["max_new_tokens"], decoding["until"]) == (50, [])
        self.asked[doc["id"]] = [text["text"], len(images)]
        return self.replies[doc["id"]]

    def generate_until_multi_round(self, requests):
        raise NotImplementedError

    def loglikelihood(self, requests):
        raise NotImplementedError


def main():
    replies, out = map(Path, sys.argv[1:])
    manager = TaskManager(include_path=str(PATH), model_name="says")
    # A built-in task of the same name would go before ours.
    names = {path.stem for path in PATH.glob("*.yaml")}
    assert {Path(manager.task_index[name]["yaml_path"]).parent for name in names} == {PATH}
    results = {}
    for who, said in json.loads(replies.read_text()).items():
        model = Says(said)
        found = simple_evaluate(model=model, tasks=[TASK], task_manager=manager, batch_size=1)
        numbers = found["results"][TASK]
        ours = {name: it for name, it in numbers.items() if name.endswith(",none")}
        results[who] = {
            name.removesuffix(",none"): value
            for name, value in ours.items()
            if "stderr" not in name
        }
    out.write_text(json.dumps({"asked": model.asked, "results": results}))


if __name__ == "__main__":
    main()
