"""Guided courses: the hand, the sensors, the heading, joints by trackers."""
