"""A case: the rig and the recordings a user gives, read and checked."""
