def expand(v): return v if "*" not in str(v) else ("wood-0","noise-0","cardboard-0","brick-0","stone-1","stone-0")
