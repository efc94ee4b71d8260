"""OpenVLA: DINOv2 and SigLIP before Llama-2; the vocabulary's last 256 ids encode actions."""
