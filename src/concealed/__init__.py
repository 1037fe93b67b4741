"""concealed: trials of `rippletwin explain` on recordings of rigs whose effect is concealed.

It reads files of the tool and of the virtual rig; neither of them imports it.
"""
