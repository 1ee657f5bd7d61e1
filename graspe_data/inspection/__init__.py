"""What a stranger's recording holds, whether it makes rows, and a manifest to begin with."""
