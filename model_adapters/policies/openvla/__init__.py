"""OpenVLA: DINOv2 and SigLIP in front of Llama-2; the last 256 ids of the vocabulary encode
actions."""
