"""Makes signatures.json out of vLLM's wheel: the names of parameters and fields, by its syntax
tree, and no code.

pip download vllm==0.33.0 --no-deps --only-binary :all: -d FOLDER
python tests/model_adapters/vllm/read_signatures.py FOLDER/vllm-*.whl

To add arguments of a newer vLLM: run this on its wheel.
"""

import ast
import json
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

# What the adapters use, by the file that has it: functions give their parameters, classes their
# fields.
_WANTED = {
    "vllm/entrypoints/llm.py": {
        "LLM": "LLM.__init__",
        "LLM.generate": "LLM.generate",
        "LLM.chat": "LLM.chat",
    },
    "vllm/engine/arg_utils.py": {"EngineArgs": "EngineArgs"},
    "vllm/sampling_params.py": {
        "SamplingParams": "SamplingParams",
        "StructuredOutputsParams": "StructuredOutputsParams",
    },
    "vllm/outputs.py": {
        "RequestOutput": "RequestOutput.__init__",
        "CompletionOutput": "CompletionOutput",
    },
    "vllm/inputs/llm.py": {"TokensPrompt": "TokensPrompt"},
}


def _definition(tree: ast.Module, path: str) -> ast.ClassDef | ast.FunctionDef:
    """A class, or the last definition of a method: overloads come before it."""
    name, _, method = path.partition(".")
    (of_class,) = [
        node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == name
    ]
    if not method:
        return of_class
    return [
        node for node in of_class.body if isinstance(node, ast.FunctionDef) and node.name == method
    ][-1]


def _names(tree: ast.Module, node: ast.ClassDef | ast.FunctionDef) -> Iterator[str]:
    if isinstance(node, ast.FunctionDef):
        yield from (
            arg.arg for arg in (*node.args.args, *node.args.kwonlyargs) if arg.arg != "self"
        )
        return
    classes = {item.name: item for item in tree.body if isinstance(item, ast.ClassDef)}
    for base in node.bases:  # fields are inherited from classes of the same file
        if isinstance(base, ast.Name) and base.id in classes:
            yield from _names(tree, classes[base.id])
    for item in node.body:
        if not (isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name)):
            continue
        if not item.target.id.startswith("_") and "ClassVar" not in ast.unparse(item.annotation):
            yield item.target.id


def signatures(wheel: Path) -> dict[str, str | list[str]]:
    """Names by what they belong to, and the version."""
    names: dict[str, str | list[str]] = {"version": wheel.name.split("-")[1]}
    with zipfile.ZipFile(wheel) as archive:
        for file, wanted in _WANTED.items():
            tree = ast.parse(archive.read(file))
            for name, path in wanted.items():
                names[name] = list(_names(tree, _definition(tree, path)))
    return names


if __name__ == "__main__":
    text = json.dumps(signatures(Path(sys.argv[1])), indent=1, sort_keys=True)
    (Path(__file__).parent / "signatures.json").write_text(text + "\n", encoding="utf-8")
