"""Draw walk.gif: two strides of the walk as a stick figure with its ground reaction forces; needs no GL."""

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from springfoot.arrays import NDArray
from springfoot.envs.control.stiffness_control import stiffness_ranges
from springfoot.envs.physics.contact import contact_offsets
from springfoot.envs.physics.model import ANKLE, HIP, KNEE, LEFT, RIGHT, TOE
from springfoot.envs.settings.settings import body_of
from springfoot.gait import GRAVITY, Body
from springfoot.gait.people.gait_events import CONTACT_THRESHOLD_BW

from ..numbers.per_leg import feet_differ, kinds_of
from ..numbers.series import foot_contacts
from ..recording.recording import TICK, Recording

SIZE = (460, 420)
"""Width and height of a frame [px]."""
OVERSAMPLING = 3
"""Frames are drawn larger by this factor and then reduced, for smooth edges."""
TICKS_PER_FRAME = 3
"""Ticks of 10 ms in a frame; GIF delays are whole hundredths of a second."""
STRIDES = 2
"""Strides that the animation shows."""
LONGEST = 3.0
"""Longest clip [s], for gaits without strides."""
MARKS_A_METRE = 4
"""Marks on the ground [1/m]."""
FORCE_LENGTH = 0.55
"""Length of an arrow of one body weight [m at 1.70 m]."""

# Colours; the near leg is the left one.
PAPER = (255, 255, 255)
INK = (34, 34, 34)
FAINT = (140, 140, 140)
GROUND = (244, 246, 247)
TRUNK = (64, 78, 92)
NEAR = (11, 110, 143)
FAR = (158, 196, 209)
FORCE = (226, 88, 34)
FAR_FORCE = (243, 178, 145)
PLAN = (209, 73, 91)
SOFT = np.array([255, 236, 179])
STIFF = np.array([122, 18, 60])
"""Colours of the softest and of the stiffest joint."""


def save_animation(path: Path, recording: Recording) -> None:
    """Write the animation of a recording: two strides from a left heel strike, or the end of a walk that only fell."""
    body = body_of(recording.settings)
    episode, first, last = clip_of(recording, body)
    series = {name: values[episode, first:last].astype(float) for name, values in recording.series.items()}
    canvas = _Canvas(body, series, recording)
    frames = [canvas.frame(tick) for tick in range(0, last - first, TICKS_PER_FRAME)]
    indexed = [frame.quantize(palette=_palette(), dither=Image.Dither.NONE) for frame in frames]
    delay = round(1000 * TICKS_PER_FRAME * TICK)
    indexed[0].save(path, save_all=True, append_images=indexed[1:], duration=delay, loop=0, optimize=True)


def clip_of(recording: Recording, body: Body) -> tuple[int, int, int]:
    """Return the episode to show, and the clip's first tick and the tick after its last: two strides, or the walk's
    end.

    The strides begin at the first left heel strike of the walk that is measured; an episode that fell, or has too few,
    shows its end.
    """
    episode = recording.example
    ticks = int(recording.ticks[episode])
    if not recording.fall_reason[episode]:
        left, _ = foot_contacts(recording.series["force"][episode, :ticks, ..., 1].sum(axis=2), body)
        strikes = np.round(left.heel_strikes / TICK).astype(int)
        measured = recording.measured_ticks
        strikes = strikes[(strikes >= measured.start) & (strikes < (measured.stop or ticks))]
        if len(strikes) > STRIDES:
            return episode, int(strikes[0]), int(strikes[STRIDES])
    return episode, max(0, ticks - round(LONGEST / TICK)), ticks


class _Canvas:
    """Draw a clip, one frame after another, through a camera that moves at the walk's mean speed.

    Points are (x, z) in metres of the world. Frames are drawn `OVERSAMPLING` times as large and then reduced.

    Args:
        body: the walking body.
        series: name -> (T, ...) of the clip's ticks, as in a recording.
        recording: the whole recording, for names and settings.
    """

    def __init__(self, body: Body, series: dict[str, NDArray], recording: Recording):
        self._body = body
        self._series = series
        self._scale = OVERSAMPLING * SIZE[1] / (1.30 * body.height)  # pixels a metre: 1.3 body heights fill a frame
        self._floor = OVERSAMPLING * SIZE[1] * 0.865  # pixel row of the floor
        ticks = np.arange(len(series["com"]))
        slope, start = np.polyfit(ticks, series["com"][:, 0], 1) if len(ticks) > 1 else (0.0, series["com"][0, 0])
        self._camera = start + slope * ticks  # (T,) x in the middle of the frame [m]
        settings = recording.settings
        self._title = recording.policy
        self._subtitle = f"{settings.height:.2f} m, {settings.mass:g} kg, {settings.speed:.2f} m/s"
        if feet_differ(settings):
            self._subtitle += " · feet: " + ", ".join(
                f"{side} ({shade}) {kind}"
                for (side, kind), shade in zip(kinds_of(settings).items(), ("dark", "light"), strict=True)
            )
        self._fonts = {size: ImageFont.load_default(OVERSAMPLING * size) for size in (11, 15)}
        self._stiffness_range = np.log(np.stack(stiffness_ranges(settings, body), axis=-1))  # (joint, end)

    def frame(self, tick: int) -> Image.Image:
        """Return the picture of the body at a tick."""
        image = Image.new("RGB", (OVERSAMPLING * SIZE[0], OVERSAMPLING * SIZE[1]), PAPER)
        self._draw = ImageDraw.Draw(image)
        self._tick = tick
        self._ground()
        self._leg(RIGHT, FAR)
        self._force(RIGHT, FAR_FORCE)
        self._trunk()
        self._leg(LEFT, NEAR)
        self._force(LEFT, FORCE)
        self._masses()
        self._words()
        return image.reduce(OVERSAMPLING)

    def _at(self, name: str) -> NDArray:
        """Return the values of the series `name` at the tick of the frame that is being drawn."""
        return self._series[name][self._tick]

    def _pixel(self, point: NDArray) -> tuple[float, float]:
        """Return the pixel (column, row) of a point (x, z) [m]."""
        x = OVERSAMPLING * SIZE[0] * 0.5 + (point[0] - self._camera[self._tick]) * self._scale
        return x, self._floor - point[1] * self._scale

    def _disc(self, centre: NDArray, radius: float, **style) -> None:
        """Draw a disc of `radius` [m] around a point (x, z) [m]; `style` as Pillow's `ellipse` takes it."""
        x, y = self._pixel(centre)
        r = radius * self._scale
        self._draw.ellipse((x - r, y - r, x + r, y + r), **style)

    def _capsule(self, start: NDArray, end: NDArray, radius: float, colour: tuple) -> None:
        """Draw a round-ended line between two points (x, z) [m], twice `radius` [m] wide."""
        width = max(1, round(2 * radius * self._scale))
        self._draw.line([self._pixel(start), self._pixel(end)], fill=colour, width=width)
        self._disc(start, radius, fill=colour)
        self._disc(end, radius, fill=colour)

    def _ground(self) -> None:
        """Draw the ground, with a mark every 0.25 m and its number every metre."""
        width = OVERSAMPLING * SIZE[0]
        height = OVERSAMPLING * SIZE[1]
        self._draw.rectangle((0, self._floor, width, height), fill=GROUND)
        self._draw.line((0, self._floor, width, self._floor), fill=FAINT, width=OVERSAMPLING)
        reach = 0.5 * width / self._scale
        middle = self._camera[self._tick]
        # Numbers of the marks that lie in the frame.
        first = int(np.floor((middle - reach) * MARKS_A_METRE))
        last = int(np.ceil((middle + reach) * MARKS_A_METRE))
        for mark in range(first, last + 1):
            x, _ = self._pixel(np.array([mark / MARKS_A_METRE, 0.0]))
            whole_metre = mark % MARKS_A_METRE == 0
            length = OVERSAMPLING * (12 if whole_metre else 6)
            self._draw.line((x, self._floor, x, self._floor + length), fill=FAINT, width=OVERSAMPLING)
            if whole_metre:
                self._text((x, self._floor + 13 * OVERSAMPLING), f"{mark // MARKS_A_METRE} m", 11, FAINT, "ma")

    def _trunk(self) -> None:
        """Draw trunk, neck and head; sizes [m at 1.70 m] by eye."""
        hip = self._at("base")[:2]
        pitch = self._at("base")[2]
        size = self._body.length_scale
        along = np.array([np.sin(pitch), np.cos(pitch)])
        shoulder = hip + self._body.trunk_length * along
        self._capsule(hip + 0.02 * size * along, shoulder - 0.05 * size * along, 0.058 * size, TRUNK)
        self._capsule(shoulder, shoulder + 0.06 * size * along, 0.025 * size, TRUNK)
        self._disc(shoulder + 0.165 * size * along, 0.095 * size, fill=TRUNK)

    def _leg(self, side: int, colour: tuple) -> None:
        """Draw thigh, shank and foot of one leg from its joint angles; widths [m at 1.70 m] by eye."""
        body = self._body
        size = self._body.length_scale
        angle = self._at("angle")[side]
        thigh = angle[HIP] - self._at("base")[2]
        shank = thigh - angle[KNEE]
        hip = self._at("base")[:2]
        knee = hip + body.thigh_length * np.array([np.sin(thigh), -np.cos(thigh)])
        ankle = knee + body.shank_length * np.array([np.sin(shank), -np.cos(shank)])
        foot = shank + angle[ANKLE]
        toe = foot + angle[TOE]
        toe_joint, (heel, ball, tip) = foot_points(body, ankle, foot, toe)
        of_heel, of_ball, of_tip = (radius for *_, radius in contact_offsets(body).values())

        self._capsule(hip, knee, 0.048 * size, colour)
        self._capsule(knee, ankle, 0.034 * size, colour)
        # The sole's outline runs below the spheres' centres, by their radii.
        under = heel + _offset_in_world((0.0, -of_heel), foot), ball + _offset_in_world((0.0, -of_ball), toe)
        self._draw.polygon([self._pixel(point) for point in (ankle, heel, *under, ball)], fill=colour)
        self._disc(heel, of_heel, fill=colour)
        self._capsule(ankle, ball, of_ball, colour)
        self._capsule(ball, tip, 0.85 * of_tip, colour)
        for joint, centre, radius in ((0, ankle, 0.026), (1, toe_joint, 0.017)):  # columns of the series `stiffness`
            self._disc(
                centre, radius * size, fill=self._stiffness_colour(side, joint), outline=PAPER, width=OVERSAMPLING
            )
        self._disc(knee, 0.014 * size, fill=PAPER)

    def _stiffness_colour(self, side: int, joint: int) -> tuple[int, int, int]:
        """Return the colour of a joint (0 ankle, 1 toe) by its K, from soft to stiff on a log scale."""
        low, high = self._stiffness_range[joint]
        # K of slack muscles is 0, and has no logarithm: 1 N m/rad at least.
        fraction = np.clip((np.log(max(self._at("stiffness")[side, joint], 1.0)) - low) / (high - low), 0, 1)
        red, green, blue = (SOFT + fraction * (STIFF - SOFT)).astype(int)
        return int(red), int(green), int(blue)

    def _force(self, side: int, colour: tuple) -> None:
        """Draw the ground reaction force of one foot as an arrow from its CoP."""
        force = self._at("force")[side]
        contact = self._at("contact")[side]
        vertical = force[:, 1].sum()
        weight = self._body.mass * GRAVITY
        if vertical < CONTACT_THRESHOLD_BW * weight:
            return
        cop = np.array([(force[:, 1] * contact[:, 0]).sum() / vertical, 0.0])
        arrow = force.sum(axis=0) / weight * FORCE_LENGTH * self._body.length_scale
        end = cop + arrow
        length = np.hypot(*arrow)
        along = arrow / length
        head = min(0.07 * self._body.length_scale, length)  # length of the tip
        across = np.array([-along[1], along[0]])
        neck = end - head * along  # where the tip begins
        line = round(0.016 * self._body.length_scale * self._scale)
        self._draw.line([self._pixel(cop), self._pixel(neck)], fill=colour, width=line)
        corners = [end, neck + 0.4 * head * across, neck - 0.4 * head * across]
        self._draw.polygon([self._pixel(point) for point in corners], fill=colour)

    def _masses(self) -> None:
        """Draw the CoM as a ring with a dot, and the plan's CoM as a larger ring."""
        size = self._body.length_scale
        self._disc(self._at("com_reference"), 0.034 * size, outline=PLAN, width=round(1.8 * OVERSAMPLING))
        self._disc(self._at("com"), 0.020 * size, fill=PAPER, outline=INK, width=OVERSAMPLING)
        self._disc(self._at("com"), 0.008 * size, fill=INK)

    def _words(self) -> None:
        """Write title and subtitle above the picture, and the legend below it."""
        unit = OVERSAMPLING
        width, height = SIZE
        self._text((14 * unit, 10 * unit), self._title, 15, INK, "la")
        self._text((14 * unit, 31 * unit), self._subtitle, 11, FAINT, "la")
        y = (height - 12) * unit
        draw = self._draw
        x = 14 * unit
        draw.ellipse((x, y - 4 * unit, x + 8 * unit, y + 4 * unit), fill=PAPER, outline=INK, width=unit)
        self._text((x + 13 * unit, y), "CoM", 11, FAINT, "lm")
        x += 48 * unit
        draw.ellipse((x, y - 5 * unit, x + 10 * unit, y + 5 * unit), outline=PLAN, width=2 * unit)
        self._text((x + 15 * unit, y), "its plan", 11, FAINT, "lm")
        x += 70 * unit
        draw.line((x, y, x + 18 * unit, y), fill=FORCE, width=3 * unit)
        self._text((x + 23 * unit, y), "ground force", 11, FAINT, "lm")
        x = (width - 128) * unit
        self._text((x - 6 * unit, y), "ankle, toe: soft", 11, FAINT, "rm")
        for step in range(60):  # the scale from soft to stiff, a pixel a step
            colour = tuple(int(c) for c in SOFT + step / 59 * (STIFF - SOFT))
            draw.rectangle((x + step * unit, y - 4 * unit, x + (step + 1) * unit, y + 4 * unit), fill=colour)
        self._text((x + 66 * unit, y), "stiff", 11, FAINT, "lm")

    def _text(self, position: tuple[float, float], words: str, size: int, colour: tuple, anchor: str) -> None:
        """Write words of a font size at a pixel; `anchor` is Pillow's: the point of the text that lies there."""
        self._draw.text(position, words, font=self._fonts[size], fill=colour, anchor=anchor)


def _palette() -> Image.Image:
    """Return one palette for all frames: every colour drawn, and its blends with the paper where edges are smoothed."""
    drawn = np.array([INK, FAINT, TRUNK, NEAR, FAR, FORCE, FAR_FORCE, PLAN], float)
    drawn = np.concatenate([drawn, SOFT + np.linspace(0, 1, 24)[:, None] * (STIFF - SOFT)])
    fraction = np.linspace(0, 1, 7)[:-1, None, None]  # the last blend is the paper itself
    colours = np.unique((drawn + fraction * (np.array(PAPER) - drawn)).round().astype(np.uint8).reshape(-1, 3), axis=0)
    image = Image.new("P", (1, 1))
    image.putpalette([*np.append(colours, [PAPER, GROUND]).astype(int).tolist()])
    return image


def foot_points(body: Body, ankle: NDArray, foot: float, toe: float) -> tuple[NDArray, list[NDArray]]:
    """Return where the toe joint of a foot lies, and the centres of its contact spheres in the order of `CONTACTS`, all
    (x, z) [m].

    `ankle` is (x, z) [m], `foot` and `toe` are pitches of these segments [rad], toes-up positive.
    """
    drop = body.ankle_height - body.toe_joint_height
    toe_joint = ankle + _offset_in_world((body.ankle_to_toe_joint, -drop), foot)
    frames = {"heel": (ankle, foot), "ball": (toe_joint, toe), "toe": (toe_joint, toe)}  # origin and pitch
    spheres = [
        frames[name][0] + _offset_in_world((forward, up), frames[name][1])
        for name, (forward, up, _) in contact_offsets(body).items()
    ]
    return toe_joint, spheres


def _offset_in_world(offset: tuple[float, float], angle: float) -> NDArray:
    """Return in the world, (x, z) [m], an `offset` (forward, up) [m] in the frame of a segment.

    `angle` is the segment's pitch [rad], toes-up positive.
    """
    forward, up = offset
    return np.array([forward * np.cos(angle) - up * np.sin(angle), forward * np.sin(angle) + up * np.cos(angle)])
