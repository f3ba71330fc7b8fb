"""What an evaluation or a sweep has found, as pages, pictures and tables. Begin with `evaluation`."""
