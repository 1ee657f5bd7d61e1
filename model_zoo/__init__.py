"""Models, training, evaluation and export; torch, shards, no bags."""
