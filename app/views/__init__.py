"""What to show, made of the state alone: texts, figures, poses."""
