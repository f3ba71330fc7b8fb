"""The page about how well controllers hold."""
