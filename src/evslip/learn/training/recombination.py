"""Windows put together from two: the object of one over all the rest of another.

A label says what the object does, and nothing of the hand, the background and the light. A few hundred samples have few
slips, but each can be seen over the surroundings of all the others. (In pictures: Dwibedi, Misra, Hebert, Cut, Paste
and Learn, ICCV 2017.)
"""

import numpy as np

from evslip.learn.training.augment import merged
from evslip.utils.errors import DataError
from evslip.windows.window_events import WindowEvents
from evslip.windows.window_set import Windows


class Recombination:
    """Training windows, a share of which have their own object's events, and elsewhere the events of another window of
    a camera at the same mount. Where the window's own object is, nothing of the other one is seen; where the other one
    had its object, nothing moves. The label is the object's. Raises DataError where the windows do not say which events
    are the object's."""

    def __init__(self, windows: Windows, share: float):
        self.windows, self._share = windows, share
        if not share:
            return
        if windows.object_events is None:
            raise DataError(
                "recombine: the windows do not say which events are the object's; expected windows of simulated "
                "samples, cut by this version"
            )
        view = windows.object_events.view
        self._partners = {str(one): np.flatnonzero(view == one) for one in np.unique(view) if one}

    def __call__(self, index: int, rng: np.random.Generator) -> WindowEvents:
        """A window, or its object over the rest of another."""
        windows, objects = self.windows, self.windows.object_events
        events = windows[index]
        if not self._share or objects is None or rng.random() >= self._share:
            return events
        partners = self._partners.get(str(objects.view[index]))
        if partners is None:  # nobody knows its bodies
            return events
        other = int(rng.choice(partners))
        own, rest = events.select(objects.is_object(index, len(events))), windows[other]
        hidden = objects.is_object(other, len(rest)) | objects.covers(index, rest, windows.settings.width)
        return merged(own, rest.select(~hidden))
