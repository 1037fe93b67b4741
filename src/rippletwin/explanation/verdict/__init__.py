"""What is reported? The decision, the verdict's file and summary, and the next experiment."""
