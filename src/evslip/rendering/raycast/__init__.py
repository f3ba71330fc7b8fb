"""The fast renderer: every surface is a formula. Begin with `renderer`; a new kind of body is a file and a line in
`body`."""
