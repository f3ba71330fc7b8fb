"""The command line: a function a verb, each of which calls one function of the library.

Begin with `VERBS`; mistakes of use are understood in `usage`.
A new verb is a function whose docstring is its help, and one line in VERBS.
"""

import os
import sys
from collections.abc import Callable

from evslip.cli import detecting, drawing, first_steps, making, seeing, sensing, showing, sweeping
from evslip.cli.usage import chosen
from evslip.utils.errors import EvslipError
from evslip.utils.version import __version__

DESCRIPTION = (
    "Event-camera data for slip detection: generate, label, train, measure. `evslip VERB --help` explains a verb."
)
VERBS: dict[str, Callable[..., None]] = {
    "demo": first_steps.demo,
    "show": showing.show,
    "generate": making.generate,
    "status": making.status,
    "verify": making.verify,
    "render": drawing.render,
    "publish": making.publish,
    "windows": detecting.windows,
    "train": detecting.train,
    "sweep": sweeping.sweep,
    "evaluate": detecting.evaluate,
    "report": detecting.report,
    "events": sensing.events,
    "calibrate-noise": sensing.calibrate_noise,
    "convert": sensing.convert,
    "import": sensing.import_,
    "info": sensing.info,
    "detect": detecting.detect,
    "export": detecting.export,
    "view": seeing.view,
    "video": seeing.video,
    "rerun": seeing.rerun,
    "label": seeing.label,
    "label-agreement": seeing.label_agreement,
    "doctor": first_steps.doctor,
}


def main() -> None:
    """Entry point. Errors of use: one line on stderr, exit code 2. Ctrl-C: exit code 130."""
    if sys.argv[1:] in (["--version"], ["-V"]):
        print(f"evslip {__version__}")
        return
    try:
        chosen(VERBS, DESCRIPTION)()
    except EvslipError as error:
        sys.exit(_fail(str(error), 2))
    except KeyboardInterrupt:
        sys.exit(_fail("stopped; what was finished is kept", 130))
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fail(message: str, code: int) -> int:
    print(f"evslip: {' '.join(message.split())}", file=sys.stderr)
    return code
