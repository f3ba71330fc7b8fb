"""The closed loop: a grip force that follows what the event camera sees, as Gymnasium environments and without them.

Begin with `episode.Episode` (one motion under control), then `environment.HoldEnv` and `controllers`.
A new controller is a file in `controllers` and a line in its register; a policy of your own needs neither:
docs/how-to/closed-loop.md.
"""

from importlib.util import find_spec

if find_spec("gymnasium") is not None:  # as Gymnasium has it, importing a package registers its environments
    from evslip.control.registration import register

    register()
