"""The verdict: decision, its file, its summary text, and the recording proposed next."""
