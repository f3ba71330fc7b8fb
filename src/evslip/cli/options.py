"""What several verbs share: types of arguments, and how they are read and told."""

from typing import Annotated, Any, Literal

from tyro.conf import UseAppendAction, arg

Overrides = Annotated[UseAppendAction[tuple[str, ...]], arg(name="set", metavar="KEY=VALUE")]
Split = Literal["train", "test"]
Align = Literal["centre", "corner"]
"""As evslip.windows.alignment.Align, without the libraries that come with it: `evslip --help` shall be quick."""


def overrides(texts: tuple[str, ...]) -> dict[str, Any]:
    """KEY=VALUE arguments as a dictionary."""
    from evslip.config.loading import parse_override

    return dict(map(parse_override, texts))


def describe(stream: Any, size: tuple[int, int]) -> str:
    """One line about a stream of events."""
    start, end = (int(stream.t_us[0]), int(stream.t_us[-1])) if stream.count else (0, 0)
    return summarise(stream.count, int(stream.p.sum()), start, end, size)


def summarise(count: int, on: int, start_us: int, end_us: int, size: tuple[int, int]) -> str:
    """One line about a stream of `count` events, `on` of them ON, between two times."""
    if not count:
        return f"no events, {size[0]}x{size[1]}"
    seconds = (end_us - start_us) / 1e6
    rate = f", {count / seconds / 1e3:,.1f} k events/s" if seconds else ""
    return f"{count:,} events in {seconds:.3f} s{rate}, {on / count:.0%} ON, {size[0]}x{size[1]}"
