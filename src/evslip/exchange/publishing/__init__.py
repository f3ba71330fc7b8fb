"""A data set as others want it: card, Croissant metadata, shards; derived from the files alone, without a network."""
