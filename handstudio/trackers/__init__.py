"""Trackers of position and attitude: what is wrong with a track, and the joints it tells."""
