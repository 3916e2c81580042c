"""Files dropped onto a window, as a file manager drops them: the source's side of the XDND protocol, version 5, over Xlib.

Blender's own code for drops answers it; nothing is called inside Blender. The protocol: https://freedesktop.org/wiki/Specifications/XDND.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import time
from collections.abc import Callable
from pathlib import Path

VERSION = 5
CLIENT_MESSAGE, SELECTION_REQUEST, SELECTION_NOTIFY = 33, 30, 31
PROPERTY_REPLACE = 0
XA_ATOM = 4
CURRENT_TIME = 0


class NoDropError(Exception):
    """The window did not take the drop."""


class _ClientMessage(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int), ("serial", ctypes.c_ulong), ("send_event", ctypes.c_int), ("display", ctypes.c_void_p),
        ("window", ctypes.c_ulong), ("message_type", ctypes.c_ulong), ("format", ctypes.c_int), ("data", ctypes.c_long * 5),
    ]  # fmt: skip


class _SelectionRequest(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int), ("serial", ctypes.c_ulong), ("send_event", ctypes.c_int), ("display", ctypes.c_void_p),
        ("owner", ctypes.c_ulong), ("requestor", ctypes.c_ulong), ("selection", ctypes.c_ulong), ("target", ctypes.c_ulong),
        ("property", ctypes.c_ulong), ("time", ctypes.c_ulong),
    ]  # fmt: skip


class _SelectionNotify(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int), ("serial", ctypes.c_ulong), ("send_event", ctypes.c_int), ("display", ctypes.c_void_p),
        ("requestor", ctypes.c_ulong), ("selection", ctypes.c_ulong), ("target", ctypes.c_ulong), ("property", ctypes.c_ulong),
        ("time", ctypes.c_ulong),
    ]  # fmt: skip


class _Event(ctypes.Union):
    _fields_ = [
        ("type", ctypes.c_int), ("message", _ClientMessage), ("request", _SelectionRequest), ("notify", _SelectionNotify),
        ("space", ctypes.c_long * 24),
    ]  # fmt: skip


def _library() -> ctypes.CDLL:
    name = ctypes.util.find_library("X11")
    if name is None:
        raise NoDropError("this machine has no libX11 to drop with")
    lib = ctypes.CDLL(name)
    window, display = ctypes.c_ulong, ctypes.c_void_p
    lib.XOpenDisplay.restype, lib.XOpenDisplay.argtypes = display, [ctypes.c_char_p]
    lib.XDefaultRootWindow.restype, lib.XDefaultRootWindow.argtypes = window, [display]
    lib.XInternAtom.restype, lib.XInternAtom.argtypes = window, [display, ctypes.c_char_p, ctypes.c_int]
    lib.XCreateSimpleWindow.restype = window
    lib.XCreateSimpleWindow.argtypes = [
        display,
        window,
        *[ctypes.c_int] * 2,
        *[ctypes.c_uint] * 3,
        *[ctypes.c_ulong] * 2,
    ]
    lib.XSetSelectionOwner.argtypes = [display, window, window, ctypes.c_ulong]
    lib.XSendEvent.argtypes = [display, window, ctypes.c_int, ctypes.c_long, ctypes.c_void_p]
    lib.XChangeProperty.argtypes = [
        display, window, window, window, ctypes.c_int, ctypes.c_int, ctypes.c_char_p, ctypes.c_int,
    ]  # fmt: skip
    lib.XGetWindowProperty.argtypes = [
        display, window, window, ctypes.c_long, ctypes.c_long, ctypes.c_int, window, ctypes.POINTER(window),
        ctypes.POINTER(ctypes.c_int), ctypes.POINTER(window), ctypes.POINTER(window), ctypes.POINTER(ctypes.c_void_p),
    ]  # fmt: skip
    lib.XQueryTree.argtypes = [
        display, window, ctypes.POINTER(window), ctypes.POINTER(window), ctypes.POINTER(ctypes.POINTER(window)),
        ctypes.POINTER(ctypes.c_uint),
    ]  # fmt: skip
    lib.XFree.argtypes = [ctypes.c_void_p]
    for function in (lib.XPending, lib.XFlush, lib.XCloseDisplay):
        function.argtypes = [display]
    lib.XNextEvent.argtypes = [display, ctypes.c_void_p]
    return lib


class _Source:
    """A small window that offers one file."""

    def __init__(self, display: str, uri: bytes) -> None:
        self.lib, self.uri = _library(), uri
        self.display = self.lib.XOpenDisplay(display.encode())
        if not self.display:
            raise NoDropError(f"display {display} cannot be opened")
        self.root = self.lib.XDefaultRootWindow(self.display)
        self.window = self.lib.XCreateSimpleWindow(self.display, self.root, 0, 0, 1, 1, 0, 0, 0)
        self.lib.XSetSelectionOwner(self.display, self.atom("XdndSelection"), self.window, CURRENT_TIME)

    def atom(self, name: str) -> int:
        return self.lib.XInternAtom(self.display, name.encode(), 0)

    def send(self, target: int, name: str, *values: int) -> None:
        message = _Event()
        message.message = _ClientMessage(
            CLIENT_MESSAGE, 0, 1, self.display, target, self.atom(name), 32, (ctypes.c_long * 5)(self.window, *values)
        )
        self.lib.XSendEvent(self.display, target, 0, 0, ctypes.byref(message))
        self.lib.XFlush(self.display)

    def wait_for(self, name: str, seconds: float, again: Callable[[], None] | None = None) -> _ClientMessage:
        """The target's answer of this name; the file is handed over meanwhile where it is asked for."""
        end, event, wanted = time.monotonic() + seconds, _Event(), self.atom(name)
        while time.monotonic() < end:
            while self.lib.XPending(self.display):
                self.lib.XNextEvent(self.display, ctypes.byref(event))
                if event.type == SELECTION_REQUEST:
                    self._hand_over(event.request)
                elif event.type == CLIENT_MESSAGE and event.message.message_type == wanted:
                    return event.message
            time.sleep(0.1)
            if again is not None:
                again()
        raise NoDropError(f"no {name} from the window in {seconds:.0f} s")

    def _hand_over(self, asked: _SelectionRequest) -> None:
        self.lib.XChangeProperty(
            self.display, asked.requestor, asked.property, asked.target, 8, PROPERTY_REPLACE, self.uri, len(self.uri)
        )
        answer = _Event()
        answer.notify = _SelectionNotify(
            SELECTION_NOTIFY,
            0,
            1,
            self.display,
            asked.requestor,
            asked.selection,
            asked.target,
            asked.property,
            asked.time,
        )
        self.lib.XSendEvent(self.display, asked.requestor, 0, 0, ctypes.byref(answer))
        self.lib.XFlush(self.display)

    def aware(self, window: int) -> bool:
        """Whether a window takes drops."""
        kind, form, count, left, data = (
            ctypes.c_ulong(), ctypes.c_int(), ctypes.c_ulong(), ctypes.c_ulong(), ctypes.c_void_p(),
        )  # fmt: skip
        self.lib.XGetWindowProperty(
            self.display, window, self.atom("XdndAware"), 0, 1, 0, XA_ATOM, ctypes.byref(kind), ctypes.byref(form),
            ctypes.byref(count), ctypes.byref(left), ctypes.byref(data),
        )  # fmt: skip
        if data.value:
            self.lib.XFree(data)
        return kind.value == XA_ATOM

    def taker(self) -> int:
        """The topmost window of the display that takes drops."""
        root, parent, count = ctypes.c_ulong(), ctypes.c_ulong(), ctypes.c_uint()
        children = ctypes.POINTER(ctypes.c_ulong)()
        self.lib.XQueryTree(
            self.display,
            self.root,
            ctypes.byref(root),
            ctypes.byref(parent),
            ctypes.byref(children),
            ctypes.byref(count),
        )
        found = [children[i] for i in range(count.value)][::-1]
        if children:
            self.lib.XFree(children)
        takes = next((one for one in found if self.aware(one)), None)
        if takes is None:
            raise NoDropError("no window on the display takes drops")
        return takes


def drop(display: str, file: Path, x: int, y: int, seconds: float = 30.0) -> None:
    """Drag a file onto the window that lies at the display's origin and let it go at (x, y), in pixels from the top left.

    NoDropError where the window does not take it.
    """
    source = _Source(display, f"{file.resolve().as_uri()}\r\n".encode())
    try:
        target, copy = source.taker(), source.atom("XdndActionCopy")
        source.send(target, "XdndEnter", VERSION << 24, source.atom("text/uri-list"), 0, 0)

        def over() -> None:
            source.send(target, "XdndPosition", 0, x << 16 | y, CURRENT_TIME, copy)

        over()
        status = source.wait_for("XdndStatus", seconds, over)
        if not status.data[1] & 1:
            raise NoDropError("the window refuses the file")
        source.send(target, "XdndDrop", 0, CURRENT_TIME, 0, 0)
        source.wait_for("XdndFinished", seconds)
    finally:
        source.lib.XCloseDisplay(source.display)
