"""Pictures of replayed episodes, for recordings and for the page."""
