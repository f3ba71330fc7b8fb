"""Pictures, plots and videos. Begin with `images` (events over frames) and `figures` (charts as JSON)."""
