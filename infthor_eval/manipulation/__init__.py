"""Pick-up and put with an arm: vision-language-action policies in single actions of long
trajectories."""
