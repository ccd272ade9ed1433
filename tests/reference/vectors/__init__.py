"""Golden vectors: the cases, how they are made, and how they are written."""

SEED = 20240229
"""Every random byte of every vector comes from this and the case's name."""
