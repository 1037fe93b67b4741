"""The line in the time domain: the method of characteristics."""
