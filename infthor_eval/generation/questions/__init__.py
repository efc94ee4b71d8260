"""Rules that generate NIEH questions from the step log of a replayed trajectory."""
