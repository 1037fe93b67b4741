"""The hydraulic line, in the frequency domain and in the time domain."""
