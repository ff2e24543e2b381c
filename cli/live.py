"""Define the command that walks a policy live in a browser: `springfoot live`."""

import socket
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import tyro

from springfoot.command_line import exit_code, parse
from springfoot.envs.settings.settings import BipedSettings
from springfoot.errors import MOST_COUNT, SpringfootError, quoted, require_count, require_number
from springfoot.evaluation.live.refused import LIVE_REFUSES
from springfoot.studies.base.flags import EVALUATED, given, optional_flags

MOST_PORT = 65535
"""Largest number of a port."""
LiveSettings = optional_flags("LiveSettings", BipedSettings, BipedSettings(), themes=EVALUATED, refused=LIVE_REFUSES)
"""Every environment setting as an optional flag; the help of refused ones says so."""


@dataclass(frozen=True, kw_only=True)
class LiveFlags:
    """Walk a policy in a browser in real time: stiffness, speed, slope, body and feet under sliders, pushes at a click.

    Open the address it prints; Ctrl-C ends it. It needs no OpenGL and loads nothing from elsewhere.
    """

    policy: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="POLICY")] = "pretrained"
    """Any policy of `springfoot evaluate`."""
    host: str = "127.0.0.1"
    """Address to listen on. By default only programs on this machine and the live page itself can steer, no other page
    in the browser; with another address everybody who reaches it."""
    port: int = 8080
    """Port to listen on, the next free one if it is taken; 0 for any."""
    seed: int = 0
    """Seed of the walk."""
    seconds: float | None = None
    """End after this time [s]; it goes on until Ctrl-C otherwise."""
    environment: tyro.conf.OmitArgPrefixes[LiveSettings]  # type: ignore[valid-type]
    """Initial values of the sliders, and all other settings."""


def live_main(arguments: Sequence[str], program: str = "springfoot live") -> int:
    """Run the command line; return its exit code: 0 ended, 2 bad input, 130 ended by Ctrl-C."""
    flags = parse(LiveFlags, arguments, program)
    return exit_code(program, lambda: run_live(flags))


def run_live(flags: LiveFlags) -> None:
    """Print the page's address, walk until the time is over, and print how many pictures a second were shown."""
    require_count("seed", flags.seed, 0, MOST_COUNT)
    require_count("port", flags.port, 0, MOST_PORT)
    _require_own_address(flags.host)
    if flags.seconds is not None:
        require_number("seconds", flags.seconds, 0.0, unit="s", above=True)
    if sys.stderr.isatty():
        print("starting…", file=sys.stderr, flush=True)
    # Not above: help and bad flags need wait neither for the simulator nor for viser.
    from springfoot.compiling import tell_of_compiling
    from springfoot.evaluation.live.steered_walk import LiveSession
    from springfoot.evaluation.live.view import LiveView

    tell_of_compiling()
    view = LiveView(LiveSession(flags.policy, given(flags.environment), flags.seed), flags.host, flags.port)
    print(f"Live at {view.address} (Ctrl-C ends it)", flush=True)
    try:
        rate = view.run(flags.seconds)
    finally:
        view.stop()
    print(f"{rate:.0f} pictures a second")


def _require_own_address(host: str) -> None:
    """Raise `SpringfootError` for a `host` on which this machine cannot listen: the server would wait for ever."""
    try:
        family, *_ = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
        with socket.create_server((host, 0), family=family):
            pass
    except (OSError, ValueError):
        raise SpringfootError(
            f"host must be an address of this machine, as 127.0.0.1, or 0.0.0.0 for all of them, got {quoted(host)}"
        ) from None
