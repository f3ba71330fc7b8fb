"""A camera on this machine's USB, by neuromorphic-drivers: DAVIS346, DVXplorer, EVK3 HD, EVK4 and others."""

import time
from typing import Any

from evslip.codecs.source import events_of
from evslip.exchange.live.address import Address
from evslip.exchange.live.source import LiveSource, Piece, Unreachable
from evslip.utils.errors import MissingExtraError


class UsbSource(LiveSource):
    """The first camera, or that of a serial number: usb://SERIAL. The driver counts no loss."""

    tells_loss = False

    def __init__(self, address: Address):
        self.name = address.text
        address.option({})
        try:
            import neuromorphic_drivers
        except ImportError as error:
            raise MissingExtraError(
                f"usb:// needs neuromorphic-drivers ({error}): pip install 'evslip[live]'"
            ) from None
        self._package: Any = neuromorphic_drivers
        self._serial = address.place or None
        self._device: Any = None

    def open(self) -> None:
        self.close()
        try:
            device = self._package.open(serial=self._serial, iterator_timeout=0.01)
            device.__enter__()
        except Exception as error:  # the driver raises RuntimeError and others, of no common base
            what = f"camera {self._serial}" if self._serial else "camera"
            reason = " ".join(str(error).split())[:120]
            raise Unreachable(
                f"{self.name}: no {what} can be opened ({reason}); expected one on USB that neuromorphic-drivers knows"
            ) from None
        properties = device.properties()
        self._device, self._size = device, (int(properties.width), int(properties.height))

    def close(self) -> None:
        if self._device is not None:
            self._device.__exit__(None, None, None)
        self._device = None

    def read(self, timeout_s: float) -> Piece | None:
        try:
            _, packet = next(self._device)
        except StopIteration:
            raise Unreachable(f"{self.name}: has gone") from None
        except Exception as error:
            raise Unreachable(f"{self.name}: broke off ({' '.join(str(error).split())[:120]})") from None
        rows = None if packet is None else getattr(packet, "polarity_events", None)
        if rows is None or not len(rows):
            return None
        return Piece(events_of(rows["t"], rows["x"], rows["y"], rows["on"]), time.monotonic())
