"""The published NIEH data: where they come from, Table 4, and replies in its logs' forms."""
