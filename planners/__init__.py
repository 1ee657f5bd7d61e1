"""Load a bundle, score trajectories, drive; numpy and onnxruntime, no torch."""
