"""The process that takes the place of Unity's player: `python -m infthor_sim.player`."""
