"""Datasets, images, networks, training, accuracy and attention."""
