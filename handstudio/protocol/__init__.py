"""The wire protocol: bytes to packets and back. No port, no clock, nothing that waits.

The byte-by-byte specification is README.md beside this file.
"""
