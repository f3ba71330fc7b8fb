"""Frames with times that nobody here rendered: how they are read, and what is put between them."""

from evslip.codecs.clips.sources import frames_from

__all__ = ["frames_from"]
