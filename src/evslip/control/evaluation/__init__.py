"""How well controllers hold: episodes played, figures of each, and figures of all with their intervals."""
