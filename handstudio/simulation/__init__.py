"""Simulated subjects: motions, the signals of every sensor, a sensor's errors, a glove's firmware.

Pure and seeded: no clock, thread, file or port. What is true here is handed out as `Truth`, for
tests and truth files only; no filter, calibration or view may ask for it.
"""
