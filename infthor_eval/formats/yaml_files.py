"""Reading YAML files safely: no alias bombs, no recursive aliases, no duplicate keys."""

from pathlib import Path
from typing import Any

import yaml

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.reading import first_duplicate, is_encodable, read_text
from infthor_eval.storage.limits import ALIAS_NODES


class PlainLoader(yaml.SafeLoader):
    """Loader of plain YAML; subclasses add the custom tags of a file format."""


def read_yaml(path: Path, hint: str, loader: type[PlainLoader] = PlainLoader) -> Any:
    """Return the content of a YAML file, whose custom tags the loader knows."""
    text = read_text(path, hint)
    with wrap_errors(
        f"{path}: not YAML", hint, catch=(yaml.YAMLError, RecursionError, ValueError, TypeError)
    ):
        reader = loader(text)
        try:
            node = reader.get_single_node()
            if node is None:
                return None
            _check(node, path)
            return reader.construct_document(node)
        finally:
            reader.dispose()


def _check(root: yaml.Node, path: Path) -> None:
    """Check the nodes of a document before values are built of them."""
    # Aliases make it a graph: each node is counted once, yet a few nodes can stand for billions of
    # values.
    sizes: dict[int, int] = {}
    above: set[int] = set()

    def size(node: yaml.Node) -> int:
        if id(node) in above:
            raise DataError(
                f"{path}: an alias refers to a node that contains it; write it out without aliases"
            )
        if id(node) not in sizes:
            above.add(id(node))
            sizes[id(node)] = 1 + sum(map(size, _children(node, path)))
            above.discard(id(node))
        return sizes[id(node)]

    if size(root) > ALIAS_NODES.value:
        raise DataError(f"{path}: has more than {ALIAS_NODES.value} values; {ALIAS_NODES.hint}")


def _children(node: yaml.Node, path: Path) -> list[yaml.Node]:
    if isinstance(node, yaml.ScalarNode) and not is_encodable(node.value):
        raise DataError(
            f"{path}: half of a character (\\ud800 to \\udfff) in a text; write it whole, or take "
            "it out"
        )
    if isinstance(node, yaml.SequenceNode):
        return list(node.value)
    if not isinstance(node, yaml.MappingNode):
        return []
    names = [key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
    duplicate = first_duplicate(names)
    if duplicate is not None:
        raise DataError(f"{path}: the key {duplicate!r} is there twice in one mapping; remove one")
    return [child for pair in node.value for child in pair]
