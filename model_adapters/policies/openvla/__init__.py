"""OpenVLA: DINOv2 and SigLIP in front of Llama-2, actions as the last 256 ids of its vocabulary."""
