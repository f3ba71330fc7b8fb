"""A data set as others want it: card, Croissant metadata, shards; derived from the files alone, without a network."""

from evslip.exchange.publishing.publish import Publication, publish

__all__ = ["Publication", "publish"]
