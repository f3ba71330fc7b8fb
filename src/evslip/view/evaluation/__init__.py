"""Results of an evaluation or a sweep, as pages, pictures and tables. Begin with `page`."""
