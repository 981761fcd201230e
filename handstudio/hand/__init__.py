"""The hand: segments and joints, placing them in space, and naming the angles between them.

Everything here is memoryless and broadcasts over a whole motion. Frames, signs and names are laid
down in CONVENTIONS.md beside this file.
"""
