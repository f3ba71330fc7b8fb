"""Names of the cameras of a bag, which its topics of events tell."""

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


def _parts(topic: str) -> list[str]:
    return topic.strip("/").split("/")
