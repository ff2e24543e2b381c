"""The live walk in a real browser: its sliders and buttons steer the simulation, and nothing else is loaded."""

import asyncio
import resource
import socket
import threading
import time
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from springfoot.cli.live import live_main
from springfoot.cli.main import main
from springfoot.evaluation.live.steered_walk import LiveSession

viser = pytest.importorskip("viser", reason="the extra live")


@pytest.fixture(scope="module")
def view():
    """A walk that goes on in a thread of its own, as the command's does in the main one."""
    from springfoot.evaluation.live.view import LiveView

    view = LiveView(LiveSession("pretrained"), port=0)
    ended = threading.Event()
    walker = threading.Thread(target=lambda: [view.run(0.2) for _ in iter(ended.is_set, True)])
    walker.start()
    yield view
    ended.set()
    walker.join()
    view.stop()


def reaches(condition, seconds=30.0):
    """Whether something comes true while the walk goes on."""
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return condition()


def test_in_a_browser_sliders_set_the_k_that_acts_and_buttons_push_and_restart(chromium, view):
    session = view._session
    tab = chromium.new_page(viewport={"width": 1280, "height": 1000})
    told, asked = [], []
    tab.on("pageerror", lambda error: told.append(str(error)))
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(view.address)
    tab.get_by_text("K that acts").wait_for(timeout=60_000)

    tab.get_by_role("combobox").first.click()
    tab.get_by_role("option", name="by hand").first.click()
    assert reaches(lambda: session.wishes.ankle_source == "by hand")
    (number,) = (each for each in tab.get_by_role("textbox").all() if each.input_value() == "300")
    number.fill("420")
    number.press("Enter")
    assert reaches(lambda: np.allclose(session.frame.stiffness[:, 0], 420.0))  # as it acted in the simulation
    assert session.data().ctrl.reshape(2, 4, 2)[:, 2, 0] == pytest.approx([420.0, 420.0])
    tab.get_by_role("cell", name="420").first.wait_for()  # and as the page tells

    tab.get_by_role("button", name="Push").click()
    assert reaches(lambda: 150.0 in [frame.push for frame in list(view._history)])
    assert reaches(lambda: view._history[-1].push == 0.0)
    frames = list(view._history)
    begin = next(at for at, frame in enumerate(frames) if frame.push)
    assert frames[begin + 4].speed - frames[begin - 1].speed > 0.1  # 150 N for 0.1 s on 63 kg are 0.24 m/s
    tab.get_by_role("button", name="Restart").click()
    assert reaches(lambda: session.frame.time < 2.0)
    tab.close()
    assert told == []
    assert {url.split("/")[2] for url in asked if url.startswith("http")} == {view.address.split("/")[2]}


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize(
    ("size", "free", "least"),
    [
        ((1280, 900), (310, 0, 870, 900), (2000, 120)),
        ((1100, 800), (0, 0, 690, 800), (2000, 120)),
        ((768, 1024), (0, 0, 350, 1024), (2000, 120)),
        ((844, 390), (0, 0, 430, 390), (600, 60)),  # half as high
        ((390, 844), (0, 0, 390, 335), (2000, 120)),
        ((390, 664), (0, 0, 390, 263), (1200, 90)),  # the same telephone with its browser's bars
        ((320, 568), (0, 0, 320, 225), (900, 80)),
    ],
)
def test_the_body_is_seen_beside_its_panels_on_screen_and_telephone(chromium, view, size, free, least, dark):
    """`free` is the part without panels: left, top, right, bottom; `least` are pixels and rows of the body."""
    told = []
    view._requests.put({"ankle_source": "policy"})
    view._requests.put(view._session.restart)
    tab = chromium.new_page(viewport=dict(zip(("width", "height"), size, strict=True)))
    tab.on("pageerror", lambda error: told.append(str(error)))
    tab.on("console", lambda message: told.append(message.text) if message.type == "error" else None)
    tab.goto(view.address)
    tab.get_by_text("K that acts").wait_for(timeout=60_000)
    for notice in tab.locator(".mantine-Notification-closeButton").all():
        notice.click()  # of viser, on machines without a GPU
    if dark:
        tab.get_by_role("button", name="Dark or light page").click()

    def picture():
        pixels = Image.open(BytesIO(tab.screenshot())).convert("RGB").crop(free)
        return np.asarray(pixels, float)

    def shows_the_body():
        red, _, blue = np.moveaxis(picture(), -1, 0)
        body = (blue > 1.5 * red) & (blue > 110.0)
        rows = np.flatnonzero(body.any(axis=1))
        return body.sum() > least[0] and np.ptp(rows) > least[1] and rows[-1] < free[3] - free[1] - 20

    assert reaches(shows_the_body)
    assert reaches(lambda: (np.median(picture()) < 60.0) == dark)
    tab.close()
    assert told == []


VALUES = [
    *(0, 1, -1, 0.5, 1e300, 10**400, float("nan"), float("inf"), -0.0, True, False, None),
    *("", "by hand", "policy", "rigid", "<img src=x onerror=alert(1)>", "\x00", 2000 * "x"),
    *([], [1.0], {}, {"value": 1}, {"kind": "weak", "strength": 0.1}, b"bytes"),
]


def send(view, uuid, updates):
    """Hand the server a message as its websocket does."""
    from viser._messages import GuiUpdateMessage

    handled = view._gui._websock_interface._handle_incoming_message(0, GuiUpdateMessage(uuid, updates))
    asyncio.run_coroutine_threadsafe(handled, view._gui._event_loop).result(10)


def megabytes():
    """Memory of this process that lies in RAM [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1e6


@pytest.mark.parametrize("count", [500, pytest.param(5000, marks=pytest.mark.slow)])
def test_a_walk_outlives_any_message(view, count):
    """Any property of any input, with values of any type, as any program that reaches the port may send them."""
    random = np.random.default_rng(0)
    handles = view._gui._gui_input_handle_from_uuid
    properties = ["value", "value", "value", "gui_api", "min", "max", "update_cb", "removed", "props", "is_button", "x"]
    before = {uuid: (vars(handle._impl).copy(), type(handle.value)) for uuid, handle in handles.items()}
    used = []
    for number in range(count):
        if number in (count // 5, count - 1):
            used.append(megabytes())
        uuid = ["nobody", *handles][random.integers(1 + len(handles))]
        names = random.choice(properties, random.integers(1, 3))
        send(view, uuid, {str(name): VALUES[random.integers(len(VALUES))] for name in names})
    session, shown = view._session, view.frames
    assert reaches(lambda: view.frames > shown + 20)
    assert used[1] - used[0] < 20.0, used
    changing = {"value", "update_timestamp", "props"}
    for uuid, handle in handles.items():
        now, (state, kind) = vars(handle._impl), before[uuid]
        assert {name: now[name] for name in now if name not in changing} == {
            name: state[name] for name in state if name not in changing
        }
        assert type(handle.value) is kind and (kind is not float or handle.min <= handle.value <= handle.max)
    assert np.isfinite(session.frame.stiffness).all()
    for name in (
        "height",
        "mass",
        "carried_ratio",
        "slope_deg",
        "left_foot",
        "right_foot",
        "ankle_source",
        "toe_source",
    ):
        default = getattr(session.wishes, name)
        assert default is not None


def test_no_message_opens_the_page_to_the_internet_or_uploads_a_file(view):
    from viser import _messages

    assert set(view._gui._websock_interface._incoming_handlers) == {_messages.GuiUpdateMessage}


def test_a_policys_name_is_text(view):
    from springfoot.evaluation.live.view import _plain

    assert _plain("<b>[a](http://b.invalid)") == r"\<b\>\[a\]\(http\:\/\/b\.invalid\)"


@pytest.mark.parametrize(
    ("policy", "person", "said"),
    [
        ("schedule", "", "schedule"),
        ("schedule", "learned", "schedule, person learned"),
        ("learned", "learned", "person learned"),
    ],
)
def test_the_page_says_who_walks(policy, person, said):
    from springfoot.evaluation.live.view import _walker

    assert _walker(policy, person) == said


def test_inputs_of_feet_are_there_where_they_do_something_and_a_load_is_a_box(view):
    handles = view._handles
    drawn = view._server.scene._handle_from_node_name

    def shown(setting):
        return {name.partition(".")[2] for name in handles if name.startswith(setting + ".") and handles[name].visible}

    everywhere = {"kind", "orthosis.ankle_stiffness"}
    assert shown("left_foot") == shown("right_foot") == everywhere
    view._requests.put({"left_foot.kind": "passive"})
    view._requests.put({"left_foot.ankle_stiffness": 450.0, "carried_ratio": 0.1})
    numbers = {"ankle_stiffness", "ankle_deg", "toe_stiffness", "toe_deg"}
    assert reaches(lambda: shown("left_foot") == everywhere | numbers)
    assert handles["left_foot.ankle_stiffness"].value == 450.0
    assert reaches(lambda: any(isinstance(handle, viser.BoxHandle) for handle in list(drawn.values())))
    view._requests.put({"left_foot.kind": "weak", "left_foot.orthosis.ankle_stiffness": 90.0})
    of_orthosis = {"orthosis.ankle_deg", "orthosis.engages"}
    assert reaches(lambda: shown("left_foot") == everywhere | {"strength"} | of_orthosis)
    assert handles["left_foot.strength"].value == 0.3
    handles["left_foot.strength"].value = 0.6  # first: the walk may answer at once
    view._requests.put({"left_foot.strength": 0.9})
    assert reaches(lambda: handles["left_foot.strength"].value == 0.3)  # back, as it cannot be
    view._requests.put({"left_foot": "intact", "carried_ratio": 0.0})
    assert reaches(lambda: shown("left_foot") == everywhere)


def test_only_this_machine_reaches_it_unless_told_otherwise(view):
    assert view.address.startswith("http://127.0.0.1:")
    assert view._server.get_host() == "127.0.0.1"


@pytest.mark.parametrize(
    ("origin", "host", "comes_in"),
    [
        ("http://127.0.0.1:{port}", None, True),
        (None, None, True),  # no browser
        ("https://example.org", None, False),
        ("http://127.0.0.1:1", None, False),
        ("null", None, False),
        ("http://example.org:{port}", "example.org:{port}", False),  # a name that leads here
    ],
)
def test_no_other_page_of_the_browser_can_steer(view, origin, host, comes_in):
    port = view._server.get_port()
    sent = {"Origin": origin, "Host": host or "127.0.0.1:{port}"}
    lines = [f"{name}: {value.format(port=port)}" for name, value in sent.items() if value]
    lines += ["Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13"]
    lines += ["Sec-WebSocket-Key: c3ByaW5nZm9vdCBmZWV0IQ==", f"Sec-WebSocket-Protocol: viser-v{viser.__version__}"]
    with socket.create_connection(("127.0.0.1", port), timeout=10.0) as connection:
        connection.sendall("\r\n".join(["GET / HTTP/1.1", *lines, "", ""]).encode())
        answer = connection.recv(1000).decode(errors="replace")
    assert answer.split()[1] == ("101" if comes_in else "403")


def test_the_command_says_where_and_ends_in_its_time(capsys):
    assert main(["live", "schedule", "--port", "0", "--seconds", "1"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("Live at http://127.0.0.1:") and said[1].endswith("pictures a second")
    assert len(said) == 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nonsense"], "no policy 'nonsense'"),
        (["schedule", "--port", "70000"], "port must be a whole number >= 0 and <= 65535, got 70000"),
        (["schedule", "--speed", "2.0"], "speed must be a finite number >= 0.6 and <= 1.8, got 2.0"),
        (["schedule", "--push-newton", "300"], "live takes no push_newton: the button Push pushes"),
        (["schedule", "--seconds", "0"], "seconds must be a finite number > 0 s, got 0.0"),
    ],
)
def test_bad_flags_are_one_line(words, said, capsys):
    assert live_main(words) == 2
    error = capsys.readouterr().err
    assert error.startswith("springfoot live: error: ") and said in error and error.count("\n") == 1
