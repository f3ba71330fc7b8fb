"""Addresses of live sources and targets."""

from typing import NamedTuple, Self
from urllib.parse import parse_qsl

from evslip.utils.errors import ConfigError


class Address(NamedTuple):
    """Place where events come from or go to."""

    text: str
    """As the user gave it."""
    scheme: str
    """`file` for what names none."""
    place: str
    """The part after the scheme, without the options."""
    options: dict[str, str]
    """The part after a question mark, such as format=faery; of a file nothing."""

    @classmethod
    def of(cls, text: str) -> Self:
        """Address in a text. Raises ConfigError for options that are none."""
        scheme, marked, rest = text.partition("://")
        if not marked:
            return cls(text, "file", text, {})
        place, _, query = rest.partition("?")
        try:
            options = dict(parse_qsl(query, strict_parsing=True)) if query else {}
        except ValueError:
            raise ConfigError(f"{text}: {query!r} cannot be read, expected ?NAME=VALUE&NAME=VALUE") from None
        return cls(text, scheme.lower(), place, options)

    def host_and_port(self) -> tuple[str, int]:
        """Name of the machine and port from 1 to 65535. Raises ConfigError."""
        host, marked, port = self.place.rpartition(":")
        host = host.removeprefix("[").removesuffix("]")
        if not marked or not host or not port.isdecimal() or not 1 <= int(port) <= 65535:
            expected = f"{self.scheme}://HOST:PORT, such as {self.scheme}://127.0.0.1:7777"
            raise ConfigError(f"{self.text}: expected {expected}, with a port from 1 to 65535")
        return host, int(port)

    def option(self, known: dict[str, tuple[str, ...]]) -> dict[str, str]:
        """Options, each one of those known; the first of them is the default. Raises ConfigError."""
        for name, value in self.options.items():
            if name not in known:
                raise ConfigError(f"{self.text}: {name} is unknown; expected {' or '.join(known) or 'no option'}")
            if value not in known[name]:
                raise ConfigError(f"{self.text}: {name} {value!r} is unknown; expected {' or '.join(known[name])}")
        return {name: self.options.get(name, values[0]) for name, values in known.items()}
