"""Training: a recipe, a dataset and a model give a checkpoint, whatever interrupts it."""
