"""Plans as the published scripts run, reward, log and tabulate them."""
