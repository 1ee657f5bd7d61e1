"""What two models share: parts of networks, and columns as networks read them."""
