"""The picture of the hand, as viser draws it."""
