"""Pictures of the whole sphere (equirectangular), as backgrounds: rooms and the outdoors."""
