"""Names of parameters in transformers 5 and in SpatialVLA's checkpoints, which transformers 4.47
wrote.

transformers has these renamings too, but applies them only to whole models that it knows. The parts
of SpatialVLA would keep their old names, and a loader that is not strict would leave ZoeDepth
random without a warning.
"""

import re

__all__ = ["checkpoint_key"]

_SIGLIP = "vision_tower."
_BEIT = "vision_zoe_model.backbone."

_BEIT_RENAMES = (
    (r"^beit\.embeddings\.", "embeddings."),
    (r"^beit\.layers\.(\d+)\.", r"encoder.layer.\1."),
    (r"\.attention\.q_proj\.", ".attention.attention.query."),
    (r"\.attention\.k_proj\.", ".attention.attention.key."),
    (r"\.attention\.v_proj\.", ".attention.attention.value."),
    (r"\.attention\.o_proj\.", ".attention.output.dense."),
    (r"\.relative_position_bias\.", ".attention.attention.relative_position_bias."),
    (r"\.mlp\.fc1\.", ".intermediate.dense."),
    (r"\.mlp\.fc2\.", ".output.dense."),
)


def checkpoint_key(name: str) -> str:
    """Return the key in a checkpoint of a parameter of the module."""
    if name.startswith(_SIGLIP) and not name.startswith(f"{_SIGLIP}vision_model."):
        return f"{_SIGLIP}vision_model.{name.removeprefix(_SIGLIP)}"
    if name.startswith(f"{_BEIT}beit."):
        part = name.removeprefix(_BEIT)
        for new, old in _BEIT_RENAMES:
            part = re.sub(new, old, part)
        return _BEIT + part
    return name
