"""What really happened, and what would have happened: computed in the world."""
