"""The concrete parameters of one sample."""

from typing import Literal

from pydantic import ValidationError

from evslip.errors import DataError
from evslip.explanation import explain
from evslip.schema import SampleSpec
from evslip.values import Constant


class Params(SampleSpec[Constant, str]):
    """One sample's parameters, every field a value. Everything else about the sample follows from them."""

    seed: int
    split: Literal["train", "test"]
    index: int

    @classmethod
    def from_json(cls, text: str | bytes) -> "Params":
        """Inverse of model_dump_json. Raises DataError."""
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            raise DataError(f"stored parameters: {explain(error, cls)}") from None
