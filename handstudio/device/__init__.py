"""Devices: where bytes come from, the thread that captures them, the one that writes them down."""
