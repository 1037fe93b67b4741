"""Readers of recordings, one file a format; `registry` names each with its suffixes.

A reader is `read(path, layout) -> Signals`: `layout` has the sensors that the rig expects and what
rig.yaml says of the file; it raises InputError where the file lacks one of them or cannot be read.
"""
