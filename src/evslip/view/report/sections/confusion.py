"""What a detector confuses: how many windows of each label it calls hold and slip."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from evslip.learn.scores.metrics import Metrics


def confusion(scores: "Metrics") -> str:
    """Table of counts and shares: rows true, columns called."""
    body = ""
    for name, row in zip(("hold", "slip"), scores.confusion, strict=True):
        cells = ""
        for count in row:
            share = count / max(1, sum(row))
            cells += (
                f'<td style="background: rgba(10, 143, 108, {0.08 + 0.5 * share:.2f})">{count:,.0f}<br>'
                f"<small>{100 * share:.1f} %</small></td>"
            )
        body += f"<tr><th>is {name}</th>{cells}</tr>"
    return f'<table class="confusion"><tr><th></th><th>called hold</th><th>called slip</th></tr>{body}</table>'
