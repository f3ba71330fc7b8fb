"""The spiking network's input neurons: one a cell, driven by its firing pixels."""

import numpy as np

from evslip.learn.layers import srm
from evslip.learn.layers.occupancy import Occupancy
from evslip.learn.layers.patterns import Patterns, groups
from evslip.utils.jit import compiled

POOL_WEIGHT = 1.1
"""Weight of a firing pixel, in thetas: the response to one firing pixel suffices for its cell to spike."""


@compiled()
def _scatter(cells, values, plane, line, places, pixels):
    """Put each cell's number of firing pixels where its neuron's lane is: pixels (row pairs, bins, lanes). `places` are
    the lanes of each unit in one row of all row pairs."""
    bins = pixels.shape[1]
    for i in range(len(cells)):
        layer, within = np.uint32(cells[i]) // np.uint32(plane), np.uint32(cells[i]) % np.uint32(plane)
        place = places[np.uint32(layer // np.uint32(bins)) * np.uint32(plane) + within]
        pixels[place // line, layer % np.uint32(bins), place % line] = np.uint8(values[i] * np.float32(16))


@compiled()
def _run(pixels, kernel, state, fired, found, starts, bins, patterns):
    """Run the neurons of each pair of rows, eight lanes a group: all first units, then all second ones ...; write the
    patterns of their spikes, clear `pixels`. Returns how many there are."""
    rise, fall, gain, own_gain, theta = kernel
    pairs, length, lanes = pixels.shape
    across = lanes // 8
    recent, response, own, own_response = state[0], state[1], state[2], state[3]
    number = 0
    for pair in range(pairs):
        state[:] = 0
        for t in range(length):
            drive = pixels[pair, t]
            for k in range(lanes):  # in one go for as many lanes as fit the processor's registers
                answer = rise * (response[k] + recent[k])
                response[k] = answer
                recent[k] = rise * recent[k] + np.float32(drive[k])
                own_answer = fall * (own_response[k] + own[k])
                own_response[k] = own_answer
                spikes = gain * answer + own_gain * own_answer >= theta
                own[k] = fall * own[k] + np.float32(spikes)
                fired[k] = spikes
            line = found[t]
            for group in range(across):
                line[group] = fired[group]
            for k in range(1, 8):
                for group in range(across):
                    line[group] |= fired[k * across + group] << np.uint8(k)
        pixels[pair] = 0
        for group in range(across):
            for t in range(length):  # written in any case, kept if there is a spike: no branch to guess
                bins[number], patterns[number] = t, found[t, group]
                number += found[t, group] != 0
            starts[pair * across + group + 1] = number
    return number


class InputNeurons:
    """One SRM neuron a cell, for occupancies of (bins, rows, columns); re-uses its scratch memory."""

    def __init__(self, grid: tuple[int, int, int]):
        bins, rows, columns = grid
        if bins > 256:
            raise ValueError(f"{bins} bins: expected at most 256")
        self.units = groups(rows, columns)
        pairs, across = -(-rows // 2), -(-columns // 2)
        self._pixels = np.zeros((pairs, bins, 8 * across), np.uint8)
        self._plane = rows * columns
        order = self.units.reshape(pairs, across, 8).transpose(0, 2, 1).ravel()
        self._places = np.empty(2 * self._plane, np.int32)
        self._places[order[order >= 0]] = np.flatnonzero(order >= 0)
        self._kernel = srm.constants(POOL_WEIGHT * srm.THETA)
        self._state = np.zeros((4, 8 * across), np.float32)
        self._fired, self._found = np.zeros(8 * across, np.uint8), np.zeros((bins, across), np.uint8)
        self._entries = np.empty((2, pairs * across * bins + 1), np.uint8)

    def __call__(self, pixels: Occupancy) -> Patterns:
        """Their spikes. Each is driven by the number of its cell's firing pixels, whose share is the value."""
        _scatter(*pixels, self._plane, self._pixels.shape[2], self._places, self._pixels)
        starts = np.zeros(len(self.units) + 1, np.int32)
        number = _run(self._pixels, self._kernel, self._state, self._fired, self._found, starts, *self._entries)
        bins, patterns = self._entries[:, :number].copy()
        return Patterns(starts, bins, patterns)
