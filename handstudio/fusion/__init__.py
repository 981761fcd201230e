"""Fusion: samples to orientations. The only room that remembers; its state is one value."""
