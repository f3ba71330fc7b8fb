"""The pages and the data behind them, as a web application."""

import threading
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route

from evslip.utils.errors import DataError, EvslipError
from evslip.view.explorer.labels import Labels, Outdated
from evslip.view.explorer.sample import Sample
from evslip.view.explorer.shelf import Shelf
from evslip.view.pictures.figures import space_time
from evslip.view.web.guard import Guard
from evslip.view.web.pages import page, static

OPEN_SAMPLES = 3
"""Kept in memory; one is up to 100 MB."""
MOST_EVENTS = 400_000
"""Most events of one response."""
CLOUD_EVENTS = 30_000
FACTS_AT_ONCE = 50


class Explorer:
    """Answers to the pages' requests about one shelf."""

    def __init__(self, shelf: Shelf, model: Path | None = None, labels: Labels | None = None):
        self.shelf, self.model, self.labels = shelf, model, labels
        self._opening = threading.Lock()
        self._open = lru_cache(maxsize=OPEN_SAMPLES)(
            lambda position: Sample(shelf.read(position), shelf.items[position].label or "")
        )
        self._answers = lru_cache(maxsize=8)(self._detect)

    def sample(self, request: Request) -> Sample:
        """The sample that a request's path names."""
        position = request.path_params["position"]
        if not position < len(self.shelf):
            raise HTTPException(404, f"there are {len(self.shelf)} samples, counted from 0")
        with self._opening:
            return self._open(position)

    def plotly(self, request: Request) -> Response:
        from plotly.offline import get_plotlyjs

        return Response(get_plotlyjs(), media_type="text/javascript", headers={"cache-control": "max-age=86400"})

    def items(self, request: Request) -> Response:
        """The list, without opening a file."""
        rows = [[item.name, item.split, item.label, item.events] for item in self.shelf.items]
        return JSONResponse({"title": self.shelf.title, "items": rows})

    def facts(self, request: Request) -> Response:
        first = _number(request, "first", 0, len(self.shelf))
        return JSONResponse(list(self.shelf.facts(first, FACTS_AT_ONCE)))

    def about(self, request: Request) -> Response:
        return JSONResponse({**self.sample(request).about(), "model": self.model is not None})

    def events(self, request: Request) -> Response:
        """Events of a span as bytes, see `sample.EVENT`; the header X-Events says how many there were."""
        start, end = _number(request, "start_us"), _number(request, "end_us")
        most = _number(request, "most", 0, MOST_EVENTS)
        packed, count = self.sample(request).packed(start, end, most)
        return Response(packed.tobytes(), media_type="application/octet-stream", headers={"x-events": str(count)})

    def frame(self, request: Request) -> Response:
        """Picture of the camera at a time, as bytes, see `Sample.pixels`: between programs on one machine, packing and
        unpacking it would take longer than handing it over."""
        t_us = _number(request, "t_us")
        return Response(self.sample(request).pixels(t_us).tobytes(), media_type="application/octet-stream")

    def cloud(self, request: Request) -> Response:
        """Events of a span in space and time, for Plotly."""
        start, end = _number(request, "start_us"), _number(request, "end_us")
        record = self.sample(request).record
        return JSONResponse(space_time(record.events.between(start, end), record.size, CLOUD_EVENTS))

    def detection(self, request: Request) -> Response:
        """The model's slip probability over time."""
        if self.model is None:
            raise HTTPException(404, "no model was given; start with --model FOLDER")
        self.sample(request)
        return JSONResponse(self._answers(request.path_params["position"]))

    def _detect(self, position: int) -> dict[str, Any]:
        from evslip.learn import detect
        from evslip.view.pictures.detection import thinned

        assert self.model is not None  # asked before
        record = self._open(position).record
        try:
            found = thinned(detect(self.model, record.events, record.size))
        except DataError:
            self._require_sensor(record.size)
            raise
        return {
            "t_us": found.t_us.tolist(),
            "p_slip": np.round(found.p_slip.astype(float), 4).tolist(),
            "threshold": found.threshold,
        }

    def _require_sensor(self, size: tuple[int, int]) -> None:
        """Raise DataError unless the model was trained on a sensor of this size; it names a command that can align the
        two, which these pages cannot."""
        from evslip.learn import load_model

        assert self.model is not None  # asked before
        _, description = load_model(self.model)
        trained = description.windows.sensor
        if size != trained:
            raise DataError(
                f"no slip probability: the sensor has {size[0]} x {size[1]} pixels, and the detector was trained on "
                f"{trained[0]} x {trained[1]}; `evslip detect --align centre` lays the one on the other"
            )

    def read_labels(self, request: Request) -> Response:
        """The intervals as they are in the file, and what a page must name to replace them."""
        return JSONResponse({**self._labels().as_json(), "recording": self._labelled()})

    async def write_labels(self, request: Request) -> Response:
        """Replace all intervals of the recording that is open; they are on disk when this answers. Refused are a page
        of another one, left over from a server that was at this address before, and a page that does not know what the
        file holds by now."""
        from starlette.concurrency import run_in_threadpool

        labels = self._labels()
        try:
            given = await request.json()
        except (ValueError, RecursionError):
            raise HTTPException(400, "expected JSON") from None
        if not isinstance(given, dict) or given.get("recording") != self._labelled():
            other = f"this page is of another recording or file of labels than those open now, {self.shelf.title} and "
            raise HTTPException(409, f"{other}{labels.path.name}; nothing was saved, load the page anew")
        try:
            version = await run_in_threadpool(labels.replace, given.get("intervals"), given.get("version"))
        except Outdated as error:
            raise HTTPException(409, str(error)) from None
        return JSONResponse({"file": labels.path.name, "version": version})

    def _labelled(self) -> str:
        """Name of what is labelled, unlike that of every other: the recording, and the file that its labels go to."""
        return f"{self.shelf.items[0].path.absolute()}, {self._labels().path.absolute()}"

    def _labels(self) -> Labels:
        if self.labels is None:
            raise HTTPException(404, "labels are made with `evslip label`")
        return self.labels


def make_app(explorer: Explorer, hosts: list[str]) -> Guard:
    """The application, which answers to the given values of the Host header alone."""
    at = "/api/samples/{position:int}"
    first = ("label", "labels") if explorer.labels is not None else ("index", "list")
    routes = [
        Route("/", lambda request: page(*first)),
        Route("/sample/{position:int}", lambda request: page("sample", "sample")),
        Route("/static/{name}", static),
        Route("/plotly.js", explorer.plotly),
        Route("/api/items", explorer.items),
        Route("/api/facts", explorer.facts),
        Route(at, explorer.about),
        Route(f"{at}/events", explorer.events),
        Route(f"{at}/frame", explorer.frame),
        Route(f"{at}/cloud", explorer.cloud),
        Route(f"{at}/detection", explorer.detection),
        Route("/api/labels", explorer.read_labels, methods=["GET"]),
        Route("/api/labels", explorer.write_labels, methods=["PUT"]),
    ]
    return Guard(Starlette(routes=routes, exception_handlers={EvslipError: _explain}), hosts)


def _explain(request: Request, error: Exception) -> Response:
    return PlainTextResponse(f"{' '.join(str(error).split())}\n", 422)


def _number(request: Request, name: str, least: int = -(2**62), most: int = 2**62) -> int:
    text = request.query_params.get(name, "")
    digits = text.removeprefix("-")
    if not digits.isascii() or not digits.isdigit() or len(digits) > 19 or not least <= int(text) <= most:
        raise HTTPException(400, f"{name}: expected a whole number from {least} to {most}")
    return int(text)
