"""The concrete parameters of one sample."""

from typing import Annotated, Literal

from pydantic import ValidationError

from evslip.config.distributions import Constant
from evslip.config.explanation import explain
from evslip.config.sample import SampleSpec
from evslip.config.section import LATER
from evslip.utils.errors import DataError


class Params(SampleSpec[Constant, str]):
    """One sample's parameters, every field a value. Everything else about the sample follows from them."""

    seed: int
    split: Literal["train", "test"]
    index: int
    seen_by: Annotated[str, LATER] = ""
    """Name of the camera whose keys the section camera has, where the sample has several: see `evslip.config.views`."""

    def stage(self, name: str) -> str:
        """Key of random numbers that each of several cameras has of its own."""
        return f"{name} {self.seen_by}" if self.seen_by else name

    @classmethod
    def from_json(cls, text: str | bytes) -> "Params":
        """Inverse of model_dump_json. Raises DataError."""
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            raise DataError(f"stored parameters: {explain(error, cls)}") from None
