"""YAML files: plain ones, with nothing in them that grows, turns in circles, or stands twice."""

from pathlib import Path
from typing import Any

import yaml

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.limits import ALIAS_NODES
from infthor_eval.formats.reading import read_text

__all__ = ["PlainLoader", "read_yaml"]


class PlainLoader(yaml.SafeLoader):
    """Plain YAML; what it is derived for are tags of a file's own."""


def read_yaml(path: Path, hint: str, loader: type[PlainLoader] = PlainLoader) -> Any:
    """What a YAML file holds.

    Args:
        path: of the file.
        mend: what to do where it is not what it should be, for the message.
        loader: knows what tags mean.

    Raises:
        DataError: it cannot be read, is no YAML, holds itself, or more than the limit once its aliases are written out.
    """
    text = read_text(path, hint)
    with wrap_errors(f"{path}: not YAML", hint, catch=(yaml.YAMLError, RecursionError, ValueError, TypeError)):
        reader = loader(text)
        try:
            node = reader.get_single_node()
            if node is None:
                return None
            _judge(node, path)
            return reader.construct_document(node)
        finally:
            reader.dispose()


def _judge(root: yaml.Node, path: Path) -> None:
    """Refuse a document by its nodes, before anything is made of them."""
    sizes: dict[int, int] = {}
    above: set[int] = set()

    def size(node: yaml.Node) -> int:
        if id(node) in above:
            raise DataError(f"{path}: a part of it holds itself; write it out without aliases")
        if id(node) not in sizes:
            above.add(id(node))
            sizes[id(node)] = 1 + sum(map(size, _children(node, path)))
            above.discard(id(node))
        return sizes[id(node)]

    if size(root) > ALIAS_NODES.value:
        raise DataError(f"{path}: holds more than {ALIAS_NODES.value} values; {ALIAS_NODES.hint}")


def _children(node: yaml.Node, path: Path) -> list[yaml.Node]:
    if isinstance(node, yaml.SequenceNode):
        return list(node.value)
    if not isinstance(node, yaml.MappingNode):
        return []
    names = [key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise DataError(f"{path}: the key {twice!r} stands twice in one mapping; take one out")
    return [child for pair in node.value for child in pair]
