"""A window of the program Blender under Xvfb, worked like a person works it: looks at the screen, moves mouse and keys.

Nothing here calls an operator or sets a property. What is on the screen is read from pictures of it: `Screen.find` looks
for a text as Blender's own font draws it.
"""

from __future__ import annotations

import dataclasses
import functools
import os
import re
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import scipy.fft
from PIL import Image, ImageDraw, ImageFont

CHECKOUT = Path(__file__).resolve().parents[2]
SIZE = (1600, 900)
FONT_SIZES = (11.4, 11.25, 11.55)
"""Pixels of Blender's interface font at a resolution scale of 1, as measured on its labels, and a little beside it: Blender
places each letter on its own, so that a long text is a pixel longer or shorter than drawn here.
"""

ALIKE = 0.67
"""Correlation of a drawn text with a place on the screen from which on it counts as found."""

SURE = 0.8
"""Correlation from which on a place is not compared with others."""

RESTS = 6
"""Looks in a row that find no thread of Blender running, after which it rests."""

HOPELESS = 0.45
"""Correlation of a first way of drawing a text below which no other way finds it either."""


@dataclasses.dataclass(frozen=True)
class Box:
    """A rectangle of the screen in pixels, y downwards."""

    left: int
    top: int
    width: int
    height: int

    @property
    def centre(self) -> tuple[int, int]:
        return self.left + self.width // 2, self.top + self.height // 2


ALL = Box(0, 0, *SIZE)


class MissingError(Exception):
    """A text that was waited for did not appear."""


class Screen:
    """A picture of the screen."""

    def __init__(self, picture: Image.Image, font: Path) -> None:
        self.picture = picture
        self.font = font

    @functools.cached_property
    def grey(self) -> np.ndarray:
        """Brightness (height, width) 0..1."""
        return np.asarray(self.picture.convert("L"), np.float32) / 255

    def places(
        self, text: str, within: Box = ALL, alike: float = ALIKE, turned: bool = False, enough: float = 2.0
    ) -> list[tuple[float, Box]]:
        """Places where the text stands, best first, with their correlation; ``turned``: reading downwards, as on tabs.

        No further way of drawing the text is tried once one correlates by ``enough``.
        """
        field = self.grey[within.top : within.top + within.height, within.left : within.left + within.width]
        patterns = [drawn(text, self.font, shift, size) for size in FONT_SIZES for shift in (0.0, 0.5)]
        patterns = [np.rot90(one, -1) if turned else one for one in patterns]
        found: list[tuple[float, Box]] = []
        for pattern, likeness in correlations(field, patterns):
            for y, x in peaks(likeness, alike, pattern.shape):
                box = Box(within.left + x, within.top + y, pattern.shape[1], pattern.shape[0])
                found.append((float(likeness[y, x]), box))
            if likeness.max() < HOPELESS or (found and max(one[0] for one in found) >= enough):
                break
        found.sort(key=lambda one: -one[0])
        kept: list[tuple[float, Box]] = []
        for likeness_, box in found:
            if all(abs(box.left - b.left) > 4 or abs(box.top - b.top) > 4 for _, b in kept):
                kept.append((likeness_, box))
        return kept

    def find(self, text: str, within: Box = ALL, turned: bool = False) -> Box | None:
        """The best place of the text, or None; the first that is surely right is taken."""
        places = self.places(text, within, turned=turned, enough=SURE)
        return places[0][1] if places else None


@functools.lru_cache(256)
def drawn(text: str, font: Path, shift: float, size: float = FONT_SIZES[0]) -> np.ndarray:
    """The text in white on black, (height, width) 0..1, as wide as its ink; ``shift`` in pixels to the right."""
    face = ImageFont.truetype(str(font), size)
    left, top, right, bottom = face.getbbox(text)
    image = Image.new("L", (int(right - left) + 3, int(bottom - top) + 2))
    ImageDraw.Draw(image).text((1 - left + shift, 1 - top), text, fill=255, font=face)
    return np.asarray(image, np.float32) / 255


def correlations(field: np.ndarray, patterns: Sequence[np.ndarray]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Each pattern that fits, and its normalised cross-correlation with every place of a field; the absolute value, so
    that dark text counts too.
    """
    patterns = [one for one in patterns if one.shape[0] <= field.shape[0] and one.shape[1] <= field.shape[1]]
    if not patterns:
        return
    high, wide = (max(one.shape[axis] for one in patterns) for axis in range(2))
    shape = tuple(scipy.fft.next_fast_len(n, real=True) for n in (field.shape[0] + high, field.shape[1] + wide))
    seen = scipy.fft.rfft2(field, shape)
    for pattern in patterns:
        h, w = pattern.shape
        p = pattern - pattern.mean()
        product = scipy.fft.irfft2(seen * np.conj(scipy.fft.rfft2(p, shape)), shape)
        total, square = (_window_sums(v, h, w) for v in (field.astype(np.float64), field.astype(np.float64) ** 2))
        variance = np.maximum(square - total * total / (h * w), 1e-3)
        inside = product[: field.shape[0] - h + 1, : field.shape[1] - w + 1]
        yield pattern, np.abs(inside) / np.sqrt(variance * float((p * p).sum()))


def _window_sums(field: np.ndarray, h: int, w: int) -> np.ndarray:
    sums = np.pad(field.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    return sums[h:, w:] - sums[:-h, w:] - sums[h:, :-w] + sums[:-h, :-w]


def peaks(likeness: np.ndarray, least: float, size: Sequence[int]) -> list[tuple[int, int]]:
    """Places (row, column) of the highest values from ``least`` on, none within another's rectangle."""
    work, found = likeness.copy(), []
    while len(found) < 40:
        y, x = np.unravel_index(int(np.argmax(work)), work.shape)
        if work[y, x] < least:
            break
        found.append((int(y), int(x)))
        work[max(0, y - size[0] // 2) : y + size[0] // 2 + 1, max(0, x - size[1] // 2) : x + size[1] // 2 + 1] = 0
    return found


class Window:
    """Blender in a window of its own on a display of its own, of 1600x900 pixels; a smaller ``size`` is drawn sooner."""

    def __init__(
        self, blender: str, user_folder: Path, arguments: Sequence[str] = (), size: tuple[int, int] = SIZE
    ) -> None:
        self.blender = blender
        self.inside = in_chroot(blender)
        self.display = free_display()
        self.folder = Path(tempfile.mkdtemp(prefix="km_makeup-window-"))
        self.environment = os.environ | {
            "DISPLAY": self.display,
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "BLENDER_USER_RESOURCES": str(user_folder),
            # Mesa's own cache is shared by every program of this user, and one that trims it ends the others by SIGBUS.
            # A folder of one's own can be kept from window to window, which then compile nothing twice.
            "MESA_SHADER_CACHE_DIR": os.environ.get("KM_WINDOW_SHADERS") or str(user_folder / "mesa"),
        }
        self.server = self._start(
            [
                *self.inside,
                "Xvfb",
                self.display,
                "-screen",
                "0",
                "1600x900x24",
                "+extension",
                "GLX",
                "-r",
            ]  # no key repeats itself
        )
        self.hand = self._start([*self.inside, "bash"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self._wait_for_display()
        log = open(self.folder / "blender.log", "w")  # noqa: SIM115 -- lives as long as Blender
        geometry = ["--window-geometry", "0", "0", *(str(n) for n in size)]
        self.process = self._start([blender, *geometry, *arguments], stdout=log, stderr=log)
        self.font = font_of(blender)

    def _start(self, command: Sequence[str], **options: object) -> subprocess.Popen:
        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        return subprocess.Popen(command, env=self.environment, start_new_session=True, **(quiet | options))  # type: ignore[call-overload]

    def _wait_for_display(self) -> None:
        for _ in range(100):
            if "ok" in self.shell("xdotool getmouselocation >/dev/null 2>&1 && echo ok"):
                return
            time.sleep(0.1)
        raise MissingError(f"no X server came up on {self.display}")

    def shell(self, command: str) -> str:
        """Run a shell command beside Blender; its output."""
        assert self.hand.stdin is not None and self.hand.stdout is not None
        self.hand.stdin.write(f"{command}\necho; echo __done__\n")
        self.hand.stdin.flush()
        lines: list[str] = []
        for line in self.hand.stdout:
            if line.strip() == "__done__":
                break
            lines.append(line)
        return "".join(lines)

    def close(self) -> None:
        """End Blender and its display, by their own process groups."""
        for process in (self.process, self.hand, self.server):
            if process.poll() is None:
                os.killpg(process.pid, 15)
                try:
                    process.wait(10)
                except subprocess.TimeoutExpired:
                    os.killpg(process.pid, 9)

    @property
    def alive(self) -> bool:
        return self.process.poll() is None

    def log(self) -> str:
        """What Blender has printed."""
        return (self.folder / "blender.log").read_text("utf-8", "replace")

    # -- looking

    def look(self) -> Screen:
        """The screen now."""
        path = self.folder / "screen.ppm"
        self.shell(f"import -silent -window root -depth 8 ppm:{path}")
        if not self.alive:
            raise MissingError(f"Blender has ended (status {self.process.returncode}):\n{self.log()[-3000:]}")
        return Screen(Image.open(path).convert("RGB"), self.font)

    def wait(self, text: str, within: Box = ALL, seconds: float = 20.0, turned: bool = False) -> Box:
        """The place of a text, once it is there."""
        end = time.monotonic() + seconds
        cut = np.s_[within.top : within.top + within.height, within.left : within.left + within.width]
        before = None
        while True:
            screen = self.look()
            if before is None or not np.array_equal(screen.grey[cut], before):
                place = screen.find(text, within, turned)
                if place is not None:
                    return place
            if time.monotonic() > end:
                screen.picture.save(self.folder / "missing.png")
                raise MissingError(f"{text!r} is not on the screen; picture: {self.folder / 'missing.png'}")
            before = screen.grey[cut]
            time.sleep(0.4)

    def still(self, seconds: float = 30.0, within: Box = ALL) -> Screen:
        """The screen once it has not changed over a second."""
        end = time.monotonic() + seconds
        before = self.look()
        while time.monotonic() < end:
            time.sleep(1)
            now = self.look()
            cut = np.s_[within.top : within.top + within.height, within.left : within.left + within.width]
            if np.abs(now.grey[cut] - before.grey[cut]).max() < 0.02:
                return now
            before = now
        return before

    def changed(self, before: Screen, within: Box, seconds: float) -> bool:
        """Whether the screen changes there within some seconds."""
        cut, end = (
            np.s_[within.top : within.top + within.height, within.left : within.left + within.width],
            time.monotonic() + seconds,
        )
        while np.abs(self.look().grey[cut] - before.grey[cut]).max() < 0.03:
            if time.monotonic() > end:
                return False
            time.sleep(0.2)
        return True

    def idle(self, seconds: float = 4.0) -> None:
        """Wait until Blender rests: what it was told is done and drawn, none of its threads runs or waits for a processor."""
        end, quiet = time.monotonic() + seconds, 0
        while quiet < RESTS and time.monotonic() < end:
            time.sleep(0.08)
            if not self.alive:
                raise MissingError(f"Blender has ended (status {self.process.returncode}):\n{self.log()[-3000:]}")
            quiet = quiet + 1 if not self._wants_to_run() else 0

    def _wants_to_run(self) -> bool:
        for file in Path(f"/proc/{self.process.pid}/task").glob("*/stat"):
            try:
                state = file.read_text().rpartition(")")[2].split()[0]
            except OSError:  # the thread has ended
                continue
            if state in "RD":
                return True
        return False

    # -- hands

    def move(self, x: int, y: int) -> None:
        self.shell(f"xdotool mousemove {x} {y}")

    def click(
        self,
        target: str | tuple[int, int] | Box,
        within: Box = ALL,
        button: int = 1,
        seconds: float = 20.0,
        turned: bool = False,
    ) -> None:
        """Click on a text, a box or a point."""
        place = self.wait(target, within, seconds, turned) if isinstance(target, str) else target
        x, y = place.centre if isinstance(place, Box) else place
        self._hover(x, y)
        self.shell(f"xdotool mousedown {button}")
        time.sleep(0.15)
        self.shell(f"xdotool mouseup {button}")
        self.idle()

    def _hover(self, x: int, y: int, seconds: float = 12.0) -> None:
        """Move onto a widget and wait until it lights up: what a busy Blender has not seen hovered it does not take for pressed.

        The mouse moves twice: the first move into a region makes it the active one, the second is the widget's.
        """
        around = Box(max(0, x - 30), max(0, y - 12), 60, 24)
        before = self.look()
        self.move(x + 1, y)
        time.sleep(0.2)
        self.move(x, y)
        self.changed(before, around, seconds)
        self.idle()

    def drag(self, points: Sequence[tuple[int, int]], button: int = 1, pause: float = 0.03) -> None:
        """Press at the first point, pass through the others, let go at the last."""
        self.move(*points[0])
        self.idle()
        self.shell(f"xdotool mousedown {button}")
        self.idle(8)  # a stroke begins where the mouse is when Blender sees the button, not where it was pressed
        for x, y in points[1:]:
            time.sleep(pause)
            self.move(x, y)
        time.sleep(0.05)
        self.shell(f"xdotool mouseup {button}")
        self.idle(20)  # a mouse that moves on before the release is seen would paint

    def wheel(self, turns: int) -> None:
        """Turn the wheel where the mouse is: down, or up by a negative number."""
        for _ in range(abs(turns)):
            self.shell(f"xdotool click {5 if turns > 0 else 4}")
            time.sleep(0.02)
        self.idle()

    def key(self, *names: str) -> None:
        """Press keys by their X names, `ctrl+z` for a chord."""
        for name in names:
            self.shell(f"xdotool key {name}")
            self.idle()

    def write(self, text: str) -> None:
        """Type a text."""
        quoted = text.replace("'", "'\\''")
        self.shell(f"xdotool type --delay 15 '{quoted}'")
        self.idle()


def in_chroot(blender: str) -> list[str]:
    """What a command of Blender's own system is started with: nothing, or the wrapper of the Debian it lies in."""
    wrapper = Path(blender).with_name("in-blender-chroot")
    return [str(wrapper)] if wrapper.is_file() else []


def font_of(blender: str) -> Path:
    """The file of Blender's interface font."""
    roots = [Path(blender).parent / "blender-chroot" / "usr" / "share" / "blender", Path(blender).resolve().parent]
    for root in roots:
        for found in sorted(root.rglob("Inter.woff2")) if root.is_dir() else ():
            return found
    shown = subprocess.run(
        [blender, "--background", "--factory-startup", "--python-expr", "import bpy; print('DATA', bpy.utils.system_resource('DATAFILES'))"],
        capture_output=True,
        text=True,
    ).stdout  # fmt: skip
    folder = re.search(r"^DATA (.+)$", shown, re.MULTILINE)
    assert folder, f"{blender} does not say where its fonts are"
    return Path(folder.group(1)) / "fonts" / "Inter.woff2"


def free_display() -> str:
    """A display number that nothing uses."""
    for number in range(90, 190):
        if not Path(f"/tmp/.X{number}-lock").exists() and not Path(f"/tmp/.X11-unix/X{number}").exists():
            return f":{number}"
    raise MissingError("displays :90 to :189 are all taken")
