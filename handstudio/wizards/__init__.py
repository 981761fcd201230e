"""Wizards: pure state machines that lead a person through something, one a file."""
