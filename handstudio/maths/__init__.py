"""Array kernels: rotations and signals. No state, no units but SI and radians."""
