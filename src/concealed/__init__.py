"""concealed: tries `rippletwin explain` on recordings whose effect is concealed, and scores it.

It reads files of both sides; neither `rippletwin` nor `virtualrig` imports it.
"""
