"""Answers to a live stream, on the terminal and on a page. Begin with `terminal`."""
