"""Let messages of a page set values of the live page's inputs, and do nothing else.

viser lets a client set any property of an input, open the page to the internet (a share address), and upload files. A
program that speaks to the port needs no page for it.
"""

from dataclasses import replace
from math import isfinite
from typing import Any

import viser
from viser._messages import GuiUpdateMessage

from springfoot.errors import as_float


def accept_values_only(server: viser.ViserServer) -> None:
    """Drop all messages to `server` but those that give one of its inputs a value that the input can show."""
    gui: Any = server.gui  # viser has no argument for it: these are parts of its own
    update = gui._handle_gui_updates

    async def set_value(client: Any, message: GuiUpdateMessage) -> None:
        """Set an input of the page to the value in a message; do nothing if `accepted` returns None for it."""
        handle = gui._gui_input_handle_from_uuid.get(message.uuid)
        value = accepted(handle, message.updates)
        if value is not None:
            await update(client, replace(message, updates={"value": value}))

    gui._websock_interface._incoming_handlers = {GuiUpdateMessage: [set_value]}


def accepted(handle: Any, updates: Any) -> Any:
    """Return the value that a message's `updates` may give the input `handle`; None for anything else.

    A number for a slider, clipped to its ends; an option for a list; True or False for a button.
    """
    if not isinstance(updates, dict) or updates.keys() != {"value"}:
        return None
    value = updates["value"]
    if isinstance(handle, viser.GuiSliderHandle):
        number = as_float(value)
        return min(max(number, handle.min), handle.max) if isfinite(number) else None
    if isinstance(handle, viser.GuiDropdownHandle):
        return value if isinstance(value, str) and value in handle.options else None
    if isinstance(handle, viser.GuiButtonHandle):
        return value if isinstance(value, bool) else None
    return None
