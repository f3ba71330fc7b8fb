"""The photorealistic renderer: Mitsuba 3 traces light paths through the scene that the fast renderer draws."""
