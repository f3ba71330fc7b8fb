"""A contact sheet of textures."""

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from evslip.scene.textures import library
from evslip.utils.atomic import write_bytes
from evslip.utils.errors import ConfigError
from evslip.utils.progress import over
from evslip.view.pictures.images import encoded

SIDE_PX, GAP_PX, CAPTION_PX = 160, 6, 16
COLUMNS = 12
PAPER, INK = (250, 250, 250), (40, 40, 40)


def write_sheet(path: Path, names: Sequence[str]) -> None:
    """Thumbnails of the named textures with their names, a family a row or more. Raises ConfigError, StorageError."""
    formats = {".png": ("PNG", {}), ".jpg": ("JPEG", {"quality": 88}), ".jpeg": ("JPEG", {"quality": 88})}
    if path.suffix.lower() not in formats:
        raise ConfigError(f"out: {str(path)!r} has no suffix of a picture, expected one of {', '.join(formats)}")
    kind, options = formats[path.suffix.lower()]
    write_bytes(path, encoded(np.asarray(contact_sheet(names)), kind, **options))


def contact_sheet(names: Sequence[str]) -> Image.Image:
    """The sheet as an image; a panorama is four thumbnails wide and shows its upper half."""
    places, row, column, width = [], 0, 0, 0
    for _, family in groupby(over("textures", names), lambda name: name.rpartition("-")[0] or str(Path(name).parent)):
        row, column = row + (column > 0), 0
        for name in family:
            picture = library.load(name, is_background=True)
            cells = 4 if library.is_panorama(picture) else 1
            if column + cells > COLUMNS:
                row, column = row + 1, 0
            places.append((name, row, column, _thumbnail(picture, cells)))
            column += cells
            width = max(width, column)
    pitch = SIDE_PX + GAP_PX
    sheet = Image.new("RGB", (width * pitch + GAP_PX, (row + 1) * (pitch + CAPTION_PX) + GAP_PX), PAPER)
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(12)
    for name, row, column, thumbnail in places:
        x, y = GAP_PX + column * pitch, GAP_PX + row * (pitch + CAPTION_PX)
        sheet.paste(thumbnail, (x, y))
        label = Path(name).name
        while pen.textlength(label, font) > thumbnail.width and len(label) > 4:
            label = label[:-4] + "..."
        pen.text((x, y + SIDE_PX + 1), label, INK, font)
    return sheet


def _thumbnail(picture: np.ndarray, cells: int) -> Image.Image:
    if cells > 1:
        picture = picture[: len(picture) // 2]
    size = (cells * SIDE_PX + (cells - 1) * GAP_PX, SIDE_PX)
    channels = [Image.fromarray(picture[..., c]).resize(size, Image.Resampling.BOX) for c in range(3)]
    linear = np.stack([np.asarray(channel) for channel in channels], -1)
    return Image.fromarray(np.round(library.linear_to_srgb(linear) * 255).astype(np.uint8))
