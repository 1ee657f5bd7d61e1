"""One file for each question about one observation: arrays in, arrays out."""
