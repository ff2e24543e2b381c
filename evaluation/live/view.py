"""Show a `LiveSession` in a browser in real time: viser's sliders, buttons and curves.

No OpenGL is needed here, as the browser draws. viser's threads put wishes into a queue; one loop obeys them, steps the
walk and shows it.
"""

import re
import time
import warnings
from collections import deque
from collections.abc import Callable
from contextlib import redirect_stdout
from functools import partial
from io import StringIO
from queue import SimpleQueue
from typing import Any, get_args

import numpy as np
import viser
from viser import uplot

from springfoot.envs.physics.model import SIDES
from springfoot.envs.settings.feet import FOOT_SETTINGS, KINDS
from springfoot.envs.settings.settings import SLOPE_RANGE_DEG
from springfoot.errors import printable
from springfoot.gait.body.body import CARRIED_RATIO_RANGE
from springfoot.gait.springs.stiffness import SPRINGS

from .foot_entries import KIND, ORTHOSIS, ORTHOSIS_WAYS, WAY, has_entry, range_of
from .messages import accept_values_only
from .origin import own_pages_only
from .scene import WIDE, LiveScene, fit_to_screen
from .steered_walk import (
    LIVE_FACTORS,
    LIVE_HEIGHTS,
    LIVE_MASSES,
    LIVE_PUSHES,
    LIVE_SPEEDS,
    OFFSETS_DEG,
    Frame,
    LiveSession,
    Source,
)

CURVE_SECONDS = 4.0
"""Length of the walk that the curves show [s]."""
CURVES_HZ = 10.0
"""Rate at which curves and words are sent [1/s]; chosen, as they cost more than the body."""
LATE = 0.25
"""Delay after which the clock stops catching up [s]; chosen."""
FIRST_PUSH = 150.0
"""Initial push of the slider [N]."""
FOOT_SLIDERS = {
    "ankle_stiffness": ("ankle K, N·m/rad", 10.0),
    "ankle_deg": ("ankle θ_eq, deg", 0.5),
    "toe_stiffness": ("toe K, N·m/rad", 5.0),
    "toe_deg": ("toe θ_eq, deg", 0.5),
    "strength": ("strength", 0.05),
    f"{ORTHOSIS}.ankle_stiffness": ("orthosis, N·m/rad", 10.0),
    f"{ORTHOSIS}.ankle_deg": ("orthosis θ_eq, deg", 0.5),
}
"""Path of a foot's number -> label and step of its slider."""
SIDE_COLOURS = ("#0072B2", "#D55E00")
"""Colours of left and right."""


class LiveView:
    """A page that shows and steers `session`; `run` walks it.

    Args:
        session: the walk.
        host: address to listen on; only this machine reaches the default.
        port: the first port to try; the next free one is taken, 0 for any.
    """

    def __init__(self, session: LiveSession, host: str = "127.0.0.1", port: int = 8080):
        session.step()  # compiles, which takes a while
        session.restart()
        self._session = session
        # From viser's threads to the loop: wishes by name, and functions to call.
        self._requests: SimpleQueue[dict[str, Any] | Callable[[], None]] = SimpleQueue()
        with redirect_stdout(StringIO()), own_pages_only(host):  # viser would print a table of addresses
            self._server = viser.ViserServer(host=host, port=port, label="springfoot live", verbose=False)
        accept_values_only(self._server)
        self._gui = self._server.gui
        _set_theme(self._gui)
        self._dark: set[int] = set()  # numbers of the browsers with a dark page
        self._curves: dict[int, dict[str, Any]] = {}  # number of a browser -> its charts
        self._server.on_client_connect(self._welcome)
        self._server.on_client_disconnect(self._forget)
        self.address = f"http://{host}:{self._server.get_port()}"
        """Address of the page."""
        self.frames = 0
        """Pictures of the body shown so far."""
        self._history: deque[Frame] = deque([session.frame], maxlen=round(CURVE_SECONDS / session.dt))
        self._handles: dict[str, Any] = {}
        self._words = self._gui.add_markdown("")
        self._add_buttons()
        self._add_wishes()
        self._scene = LiveScene(self._server, session)
        self._show()
        self._send_numbers()

    def run(self, seconds: float | None = None) -> float:
        """Walk in real time for `seconds`, for ever if None; return the shown pictures a second.

        Each step is `due` at a time of the clock. Late steps leave out pictures, so that the walk catches up; after a
        delay over `LATE` the clock is set back instead.
        """
        dt = self._session.dt
        begin = time.perf_counter()
        frames_before = self.frames
        due = begin
        steps_a_curve = max(1, round(1 / (CURVES_HZ * dt)))
        step = 0
        while seconds is None or time.perf_counter() - begin < seconds:
            self._apply_requests()
            self._history.append(self._session.step())
            due = due + dt
            step = step + 1
            if time.perf_counter() - due < dt:  # less than a step late
                self._show()
            if step % steps_a_curve == 0:
                self._send_numbers()
            delay = time.perf_counter() - due
            if delay > LATE:
                due = due + delay
            time.sleep(max(0.0, -delay))  # until the step is due, if it is early
        return (self.frames - frames_before) / (time.perf_counter() - begin)

    def stop(self) -> None:
        """Close the page."""
        with redirect_stdout(StringIO()):
            self._server.stop()

    def _apply_requests(self) -> None:
        """Apply the wishes and calls that came from the page since the last step.

        After an impossible wish the page shows the error, and its input the present value again.
        """
        wishes: dict[str, Any] = {}
        try:
            while not self._requests.empty():
                request = self._requests.get()
                if isinstance(request, dict):
                    wishes |= request
                else:
                    request()
            if wishes:
                self._session.ask(**wishes)
                self._fit_inputs_to_feet(wishes)
        except Exception as error:  # a walk outlives whatever a message asks
            for client in self._server.get_clients().values():
                client.add_notification("This cannot be", printable(str(error)), auto_close_seconds=8.0, color="red")
            for name in wishes:
                self._handles[name].value = self._session.wishes.named(name)

    def _add_buttons(self) -> None:
        """Add the buttons Push, Restart and page colour, and the slider of the push."""
        push = self._gui.add_button("Push")
        restart = self._gui.add_button("Restart")
        size = self._gui.add_slider(
            "Push, N", *LIVE_PUSHES, step=10.0, initial_value=FIRST_PUSH, hint="forward positive"
        )
        theme = self._gui.add_button("Dark or light page", color="gray")
        theme.on_click(lambda event: self._requests.put(partial(self._turn_theme, event.client)))
        push.on_click(lambda _: self._requests.put(lambda: self._session.push(size.value)))
        restart.on_click(lambda _: self._requests.put(self._session.restart))

    def _welcome(self, client: viser.ClientHandle) -> None:
        """Fit the page of a new browser to its size: camera, and curves beside the body or below the inputs."""
        fit_to_screen(client)
        self._curves[client.client_id] = _add_curves(client.gui, wide=client.camera.image_width >= WIDE)

    def _forget(self, client: viser.ClientHandle) -> None:
        """Drop the charts of a browser that left, so that no more curves are sent to it."""
        self._curves.pop(client.client_id, None)

    def _turn_theme(self, client: viser.ClientHandle | None) -> None:
        """Turn the page of one browser dark, or light again; others keep theirs."""
        if client is not None:
            self._dark ^= {client.client_id}  # in, or out again
            _set_theme(client.gui, client.client_id in self._dark)

    def _add_wishes(self) -> None:
        """Add a slider or a list for each of the `Wishes`."""
        ranges = self._session.stiffness_ranges()
        for joint, name in enumerate(SPRINGS):
            with self._gui.add_folder(f"{name.capitalize()}: stiffness K"):
                self._add_list(f"{name}_source", "from", get_args(Source))
                self._add_slider(f"{name}_factor", "scaled: factor", LIVE_FACTORS, 0.05)
                low, high = ranges[joint].tolist()
                self._add_slider(f"{name}_stiffness", "by hand, N·m/rad", (round(low), round(high)), 1.0)
                self._add_slider(f"{name}_offset_deg", "θ_eq, added deg", OFFSETS_DEG, 0.5)
        with self._gui.add_folder("Walk"):
            self._add_slider("speed", "speed, m/s", LIVE_SPEEDS, 0.05)
            self._add_slider("slope_deg", "slope, deg", SLOPE_RANGE_DEG, 0.5)
        with self._gui.add_folder("Body"):
            self._add_slider("height", "height, m", LIVE_HEIGHTS, 0.01)
            self._add_slider("mass", "mass, kg", LIVE_MASSES, 1.0)
            self._add_slider("carried_ratio", "carried, of mass", CARRIED_RATIO_RANGE, 0.05)
        for side, setting in zip(SIDES, FOOT_SETTINGS, strict=True):
            with self._gui.add_folder(f"{side.capitalize()} foot"):
                self._add_list(f"{setting}.{KIND}", "kind", tuple(KINDS))
                for path, (label, step) in FOOT_SLIDERS.items():
                    self._add_slider(f"{setting}.{path}", label, range_of(path), step)
                self._add_list(f"{setting}.{WAY}", "orthosis acts in", ORTHOSIS_WAYS)
        self._fit_inputs_to_feet({})

    def _fit_inputs_to_feet(self, wishes: dict[str, Any]) -> None:
        """Show the inputs that do something on the present feet, and hide the others.

        If the `wishes` just granted change the kind of a foot, its inputs show the numbers of the new kind.
        """
        present = self._session.wishes
        for setting in FOOT_SETTINGS:
            for path in (*FOOT_SLIDERS, WAY):
                name = f"{setting}.{path}"
                handle = self._handles[name]
                handle.visible = has_entry(getattr(present, setting), path)
                if f"{setting}.{KIND}" in wishes:
                    handle.value = present.named(name)

    def _add_slider(self, name: str, label: str, ends: tuple[float, float], step: float) -> None:
        """Add a slider for the wish `name`, from end to end in steps."""
        value = float(np.clip(self._session.wishes.named(name), *ends))
        self._handles[name] = self._gui.add_slider(label, *map(float, ends), step=step, initial_value=value)
        self._listen(name)

    def _add_list(self, name: str, label: str, options: tuple[str, ...]) -> None:
        """Add a list of options for the wish `name`."""
        value = self._session.wishes.named(name)
        self._handles[name] = self._gui.add_dropdown(label, options, initial_value=value)
        self._listen(name)

    def _listen(self, name: str) -> None:
        """Put the wish `name` into the queue whenever its input changes.

        A change without a client is our own: the input shows the present value again.
        """
        handle = self._handles[name]
        handle.on_update(lambda event: self._requests.put({name: handle.value}) if event.client is not None else None)

    def _show(self) -> None:
        """Draw the body, and count the picture."""
        self._scene.show()
        self.frames += 1

    def _send_numbers(self) -> None:
        """Send the last step's numbers and the curves of the last seconds to the page."""
        last_frame = self._history[-1]
        session = self._session
        rows = "\n".join(
            f"| {side} | {k[0]:.0f} | {k[1]:.0f} | {equilibrium[0]:.1f} | {equilibrium[1]:.1f} |"
            for side, k, equilibrium in zip(
                SIDES, last_frame.stiffness, np.degrees(last_frame.equilibrium), strict=True
            )
        )
        state = f"**fell: {last_frame.fell}**" if last_frame.fell else f"{last_frame.speed:.2f} m/s"
        self._words.content = (
            f"{_walker(session.name, session.person)}: {last_frame.time:.1f} s, {state}, falls: {session.falls}\n\n"
            "| K that acts, N·m/rad | ankle | toe | ankle θ_eq, deg | toe θ_eq, deg |\n|-|-|-|-|-|\n" + rows
        )
        seconds = session.dt * np.arange(1 - len(self._history), 1)  # up to 0, the last step
        stiffness, force = (
            np.array([getattr(frame, name) for frame in self._history]) for name in ("stiffness", "force")
        )
        # Chart -> (line, step): left and right, or one.
        curves = {name: stiffness[:, :, joint].T for joint, name in enumerate(SPRINGS)}
        curves["load"] = force[..., -1].T  # the last component, up
        curves["speed"] = np.array([[frame.speed for frame in self._history]])
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Queued a", category=UserWarning)  # for a browser that just left
            for charts in list(self._curves.values()):
                for name, lines in curves.items():
                    charts[name].data = (seconds, *np.ascontiguousarray(lines))


def _add_curves(gui: viser.GuiApi, wide: bool) -> dict[str, Any]:
    """Add the charts over time to one browser's page; return them by the name of their quantity.

    On a wide page they stand on the left, on others below the inputs.
    """
    titles = {"ankle": "K of the ankles, N·m/rad", "toe": "K of the toes, N·m/rad", "load": "Load, body weights"}
    title = "Curves, the last seconds"
    if wide:
        panel = gui.add_panel()
        panel.dock_left()
        place: Any = panel.add_tab(title)
    else:
        place = gui.add_folder(title)
    with place:
        sides = [{"label": side, "stroke": shade, "width": 2} for side, shade in zip(SIDES, SIDE_COLOURS, strict=True)]
        charts = {name: _chart(gui, title, sides) for name, title in titles.items()}
        return charts | {"speed": _chart(gui, "Speed of the CoM, m/s", [{"label": "speed", "stroke": "#009E73"}])}


def _chart(gui: viser.GuiApi, title: str, lines: list[dict[str, Any]]) -> Any:
    """Add a chart of `lines` over time [s]; return its handle."""
    empty = np.zeros(1)
    series: Any = ({"label": "s"}, *lines)
    time_scale: dict[str, uplot.Scale] = {"x": {"time": False}}
    return gui.add_uplot((empty,) * len(series), series, title=title, scales=time_scale, height=170)


def _set_theme(gui: viser.GuiApi, dark: bool = False) -> None:
    """Make the page of `gui`, of one browser or of all, light or dark, without viser's own marks."""
    gui.configure_theme(show_logo=False, show_share_button=False, control_width="large", dark_mode=dark)


def _walker(policy: str, person: str) -> str:
    """Return the names of the policy and of the learned `person` ("" for none), in Markdown; one name if the policy is
    the person."""
    names = {policy: _plain(policy)} | ({person: f"person {_plain(person)}"} if person else {})
    return ", ".join(names.values())


def _plain(name: str) -> str:
    """Return a name as Markdown that shows it as it is: no link, no HTML."""
    return re.sub(r"([!-/:-@\[-`{-~])", r"\\\1", name)
