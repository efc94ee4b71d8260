"""Lets torchvision's Python half load without its compiled one, for peers that insist on it (there
is no CPU build).

On the path of test subprocesses only: transformers must find these operators declared before it
looks at torchvision.
"""

import torch

library = torch.library.Library("torchvision", "DEF")
library.define("nms(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
library.define("qnms(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
