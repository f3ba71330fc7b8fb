"""Frames with times that nobody here rendered: how they are read, and what is put between them."""
