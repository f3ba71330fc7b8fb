"""Cameras of a bag: their names, which topics of events have, and the topics of images that are theirs."""

from collections.abc import Sequence
from itertools import zip_longest


def names(topics: Sequence[str]) -> list[str]:
    """Names of the cameras of these topics of events, which differ: the first part of the topics that tells all of them
    apart, such as left of /davis/left/events, or else all parts in which they differ."""
    columns = list(zip_longest(*map(_parts, topics), fillvalue=""))
    telling = [column for column in columns if len(set(column)) == len(topics) and all(column)]
    if telling:
        return list(telling[0])
    differing = [column for column in columns if len(set(column)) > 1]
    return ["/".join(filter(None, parts)) for parts in zip(*differing, strict=True)]


def images_of(chosen: str, others: Sequence[str], images: Sequence[str]) -> list[str]:
    """Topics of images that may be of the camera of a topic of events, those in its namespace if there are any.

    others: the topics of events of the other cameras, which an image must not be as near to.
    """
    nearer = [one for one in images if all(_common(one, chosen) > _common(one, other) for other in others)]
    namespace = chosen.rpartition("/")[0]
    return [one for one in nearer if one.startswith(f"{namespace}/")] or nearer


def _common(one: str, other: str) -> int:
    """Number of parts that two topics begin with."""
    pairs = list(zip(_parts(one), _parts(other), strict=False))
    return next((number for number, (mine, its) in enumerate(pairs) if mine != its), len(pairs))


def _parts(topic: str) -> list[str]:
    return topic.strip("/").split("/")
