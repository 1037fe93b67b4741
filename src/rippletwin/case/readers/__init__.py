"""Readers of recordings, one file a format; `registry` names each with its suffixes.

A reader is `read(path, sensors) -> Signals`: `sensors` are the names the rig expects; it raises
InputError where the file lacks one of them or cannot be read.
"""
