"""A detector on a stream of events. Begin with `stream.Detector`."""
