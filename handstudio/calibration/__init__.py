"""From signals at rest to what a sensor and a hand are: attitudes, mounting."""
