"""Having questions answered: what answers, within which budget of tokens, behind which memory."""
