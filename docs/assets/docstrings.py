"""Lists in docstrings: lines `name: what it is`, continued by an indent, become lists in the site."""

import re
from typing import Any

import griffe

_ITEM = re.compile(r"(?P<name>[\w*`.]+(?:, [\w*`.]+)*): (?P<about>\S.*)")


class Lists(griffe.Extension):
    """Makes lists of the arguments and fields that plain docstrings name, and leaves out what has none."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Rewrite the docstring of one object."""
        if obj.docstring is not None:
            obj.docstring.value = as_lists(obj.docstring.value)

    def on_class_members(self, *, cls: griffe.Class, **_: Any) -> None:
        """Leave out what a constructor keeps without a word on it."""
        for name, member in list(cls.members.items()):
            if not isinstance(member, griffe.Attribute) or member.docstring is not None or member.value is None:
                continue
            if member.labels == {"instance-attribute"}:
                cls.del_member(name)


def as_lists(text: str) -> str:
    """The text with its runs of `name: ...` lines as Markdown lists."""
    lines: list[str] = []
    inside = False
    for line in text.splitlines():
        item = _ITEM.fullmatch(line)
        if item and not lines and line[0].isupper():
            item = None  # "Scene: shapes, textures" is a summary.
        if item and (inside or not lines or not lines[-1].strip()):
            if not inside and lines:
                lines.append("")
            lines.append(f"- **{item['name']}**: {item['about']}")
            inside = True
        else:
            inside = inside and line.startswith("    ")
            lines.append(line)
    return "\n".join(lines)
