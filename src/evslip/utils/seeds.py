"""Random generators keyed by what they are for, so that no draw depends on another."""

import zlib

import numpy as np

SPLITS = ("train", "test")


def generator(seed: int, split: str, index: int, stage: str) -> np.random.Generator:
    """The generator of one stage of one sample; equal keys give equal streams on any machine."""
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(_key(seed, split, index, stage))))


def integer(seed: int, split: str, index: int, stage: str) -> int:
    """A 64-bit seed for a stage that does its own counting (the pixel model)."""
    return int(np.random.SeedSequence(_key(seed, split, index, stage)).generate_state(1, np.uint64)[0])


def _key(seed: int, split: str, index: int, stage: str) -> list[int]:
    return [seed, SPLITS.index(split), index, zlib.crc32(stage.encode())]
