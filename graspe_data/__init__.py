"""What one observation is: recordings, observations, labels and shards, in numpy."""
