"""Shares of the samples that have each nuisance."""

from typing import Annotated

from pydantic import Strict

from evslip.config.section import LATER, Section, Within

Share = Annotated[float, Strict(), Within(0.0, 1.0)]


class ShareSpec(Section):
    """How many of a data set's samples have a section; the others are as if it were not given."""

    clutter: Share = 1.0
    """Share of the samples that have the section clutter."""
    disturbance: Annotated[Share, LATER] = 1.0
    """Share of the samples that have the section disturbance."""
    flicker: Share = 1.0
    """Share of the samples that have the section flicker."""
    lens: Share = 1.0
    """Share of the samples that have the section lens."""
    passers: Share = 1.0
    """Share of the samples that have the section passers."""
    readout: Share = 1.0
    """Share of the samples that have the section readout."""
    vibration: Share = 1.0
    """Share of the samples that have the section vibration."""
