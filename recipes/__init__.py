"""How the weights that come with the package are made; beside the packages, in no wheel."""
