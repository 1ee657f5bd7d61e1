"""The models: a file for each paper, with its ablations and variants; a new file is found."""
