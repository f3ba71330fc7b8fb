"""Whether an NVIDIA GPU can be used."""

from evslip.utils.errors import MissingExtraError


def require_cuda(key: str) -> None:
    """Raise MissingExtraError, naming the key that asks for 'cuda', where there is no usable GPU."""
    # numba's CUDA takes a moment to import, and asks for a driver.
    from numba import cuda

    if not cuda.is_available():
        raise MissingExtraError(
            f"{key}: 'cuda' needs an NVIDIA GPU with its driver, and pip install 'evslip[cuda]'; "
            "neither may be missing. 'cpu' works everywhere"
        )
