"""docs/thesis.md and its pictures: the thesis as printed, corrected, and people.

springfoot study thesis --page docs/thesis.md
"""

import re
import textwrap
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from springfoot.files.markdown import table
from springfoot.files.writing import write_atomically
from springfoot.gait import SpringfootError, thesis_schedule
from springfoot.gait.plan.thesis import GRAVITY, INTERPOLATIONS, ThesisWalk

from .base.study import Answer, OnProgress, Study
from .thesis_figures import FIGURES, PHASE, DrawnWalk, as_planned, as_printed, of_people, save_figure
from .thesis_tables import BODY, STRIDE, THESIS_SPEED, cart_table, claims, corrected, moments, people_work, springs

LINE_WIDTH = 130
PRINTED_TIMES = np.linspace(0.5, 1.25, 7501)
"""Times of the thesis's figures [s]."""


def walks() -> tuple[DrawnWalk, DrawnWalk, DrawnWalk]:
    """The three columns of every figure."""
    return as_printed(ThesisWalk()), as_planned(corrected()), of_people(THESIS_SPEED, BODY)


TITLE = "# The thesis: as printed, corrected, and people"
"""First line of the page."""


def page() -> str:
    """The text of docs/thesis.md; every number in it is computed."""
    sections = [_head(), *_figures(*walks()), claims(), cart_table(), moments(), springs(), _references()]
    blocks = "\n\n".join(sections).split("\n\n")
    text = "\n\n".join(block if block[0] in "#|!" else _filled(block) for block in blocks) + "\n"
    return re.sub(r"(?<![\w-])-(?=\d)", "−", text)


def _filled(paragraph: str) -> str:
    words = " ".join(paragraph.split())
    return textwrap.fill(words, LINE_WIDTH, break_long_words=False, break_on_hyphens=False)


def _head() -> str:
    plan = corrected()
    return f"""{TITLE}

D. W. Nam, *Numerical analysis of ZMP based biped walking model with different stiffness of ankle and toe joint*, DGIST
2016. **As printed** is `springfoot.gait.plan.thesis`: its via-points and formulas, faults included; names that its
program never defines are read as `READINGS` there says. **Corrected** is `plan_walk(Body(), {THESIS_SPEED},
"thesis")`: the same body, step ({plan.step_length:.1f} m in {plan.step_time:.1f} s) and double support
({plan.double_support:.2f} s), and a CoM that obeys equation (1) over a ZMP under the feet. **People** are the mean
curves of `human_gait({THESIS_SPEED})`. `springfoot study thesis --page docs/thesis.md` writes this page.

All figures show the thesis's 0.75 s on one axis: from the other foot's heel strike (50 % of this foot's stride) over
its own (100 %) into stance. Double support is grey, dots are via-points."""


def _figures(printed: DrawnWalk, plan: DrawnWalk, people: DrawnWalk) -> list[str]:
    three = (printed, plan, people)
    walk = ThesisWalk()
    sway, rise = np.transpose([100 * np.ptp(each.com_wave, axis=1) for each in three])
    lowest = [100 * 2 * (PHASE[each.com[1][:500].argmin()] - 0.5) for each in three]
    times, places = walk.knot_times, walk.com_knots[0]
    speeds = (np.diff(places) / np.diff(times))[:3]
    height = corrected().com(STRIDE)[1].mean()

    swing, flat = (PHASE > 0.65) & (PHASE < 0.95), 1 + printed.double_support / 2 <= PHASE
    apex = [100 * each.ankle[1][swing].max() for each in three]
    foot = 1000 * np.hypot(*np.subtract(walk.ankle_knots, walk.toe_joint_knots))

    vertical = [f"{100 * each.force[1].min():.1f} to {100 * each.force[1].max():.1f} %" for each in (printed, plan)]
    fore_aft = []
    for name in INTERPOLATIONS:
        share = 100 * ThesisWalk(interpolation=name).com_acceleration(PRINTED_TIMES)[0] / GRAVITY
        fore_aft.append(f"{name} {share.min():+.0f} … {share.max():+.0f} %")

    outside = walk.zmp_outside(PRINTED_TIMES)
    step = np.arange(10_000) / 10_000
    (rear, front), zmp = corrected().support(step), corrected().zmp(step)
    margin = 1000 * np.minimum(zmp - rear, front - zmp).min()
    matrix = ThesisWalk(interpolation="least-squares cubic", division="matrix")
    behind = 1000 * float(matrix.com(1.0)[0] - matrix.zmp(1.0))

    def figure(number: int, name: str, text: str) -> str:
        return f"## Figure {number}: {name}\n\n![Figure {number}](thesis/figure-{number}.png)\n\n{text}"

    return [
        figure(
            6,
            "CoM",
            f"""Line plus sine is right, its size is not: about the mean motion the printed CoM sways {sway[0]:.1f} cm,
            the plan's {sway[1]:.1f}, people's {sway[2]:.1f}. The via-points ask for mean speeds of {speeds[0]:.2f},
            {speeds[1]:.2f} and {speeds[2]:.2f} m/s within a step: the first two for {places[1] - places[0]:.2f} m in a
            double support of {times[1] - times[0]:.2f} s, and the third holds the CoM
            {walk.com_behind_at_start / 2:.3f} m behind the ankle at mid-step, where it passes over it. Rise and fall
            ({rise[0]:.1f}, {rise[1]:.1f}, {rise[2]:.1f} cm) is half a step out of phase: lowest {lowest[0]:.0f} % of a
            step after heel strike, where plan and people have {lowest[1]:.0f} and {lowest[2]:.0f} %, in double support.
            0.89 m is the height of a hip; the CoM of this body walks at {height:.2f} m. (People's CoM: their forces,
            integrated twice.)""",
        ),
        figure(
            7,
            "ankle joint",
            f"""One via-point in swing lifts the ankle {apex[0]:.0f} cm at mid-step; people lift it {apex[2]:.0f}, the
            plan {apex[1]:.0f}, sooner and toes down. While the foot stands, the spline rolls the ankle by
            {100 * np.ptp(printed.ankle[0][flat]):.0f} cm. (People's: their angles on this body, under a hip that moves
            as their forces say.)""",
        ),
        figure(
            8,
            "toe joint",
            f"""The spline runs {-1000 * printed.toe_joint[1][flat].min():.0f} mm into the floor under a standing foot:
            it cannot hold a constant between two knots, as the thesis says itself. The plan joins rockers and swing;
            its toe joint moves by {1000 * np.ptp(plan.toe_joint[1][1 + corrected().feet.foot_flat <= PHASE]):.1f} mm
            from foot flat on (at 2 cm: the joint is inside the foot). At heel strike the appendix subtracts l_an sin
            q_f from the toe joint as from the ankle, so that the foot is {foot[3]:.1f} mm from ankle to toe joint,
            elsewhere {foot[0]:.1f}. Section 2.3 has this x right, and z wrong.""",
        ),
        figure(
            9,
            "ground reaction force",
            f"""Solid both feet, dashed this foot. Vertical: {vertical[0]} of body weight as printed, {vertical[1]}
            planned, in opposite phase: force is largest where the CoM is lowest. The printed force is not shared
            between the feet, hence never 0. Fore-aft it depends on what joins the via-points: {"; ".join(fore_aft)}.
            The last is nearest the 70 % in the text.""",
        ),
        figure(
            10,
            "ZMP",
            f"""Yellow: feet on the ground; dotted: CoM. By equation (1) the printed ZMP is off the feet
            {100 * np.mean(outside != 0):.0f} % of the time, by up to {100 * outside.max():.0f} cm ahead of the toes
            ({PRINTED_TIMES[outside.argmax()]:.2f} s, heel strike) and {-100 * outside.min():.0f} cm behind the heel
            ({PRINTED_TIMES[outside.argmin()]:.2f} s), each foot counted whole from heel strike to toe-off. The thesis
            saw it follow the CoM "under the plantar": its program divides two rows by `/`, in MATLAB one least-squares
            quotient and not a division at each time, and so gets the CoM moved by a constant ({behind:.0f} mm for the
            least-squares cubic). The plan's is inside at 10 000 samples of a step, by {margin:.1f} mm at least.
            (People's: centres of pressure of both feet, one subject's, weighed by their forces.)""",
        ),
    ]


def _references() -> str:
    speeds = (0.85, 1.2, 1.5)
    springs = [thesis_schedule(BODY, speed).ankle[1].stiffness for speed in speeds]
    work = people_work()
    rows = [
        (
            "ankle does the largest positive work (Collins and Kuo 2010)",
            f"true of people: {', '.join(f'{name} {value:.2f}' for name, value in work.items())} J/kg a stride",
        ),
        (
            "torque from force is almost inverse dynamics (Wells 1981)",
            "true of ankle and toe, and of the knee in stance: above",
        ),
        (
            "stiffness changes with speed (Huang et al. 2012)",
            "people's line foot flat → maximum dorsiflexion: "
            + ", ".join(f"{k:.0f} N·m/rad at {v:g} m/s" for k, v in zip(springs, speeds, strict=True)),
        ),
        ("speed changes with stiffness (Huang et al. 2012)", "`evaluate.py constant:300,40` beside other constants"),
        (
            "a toe joint: less knee range, faster (HRP-2, 2006), longer double support (Ahn et al. 2003)",
            "`evaluate.py constant:300,40` beside `constant:300,200`, a toe all but locked",
        ),
        (
            "passive prostheses cost 10–30 % more",
            "metabolic cost is not modelled; `evaluate.py` gives cost of transport",
        ),
    ]
    return "## Claims of its references that can be tested here\n\n" + table(("claim", "test"), rows)


@dataclass(frozen=True, kw_only=True)
class Thesis(Study):
    """The thesis as printed, corrected, and people: a page of text, tables and figures, every number computed.

    `--page docs/thesis.md` writes the whole page, not a section of one, and its pictures into a folder beside it.
    """

    def ask(self, progress: OnProgress) -> Answer:
        """Compute the page."""
        drawn, text = walks(), page()
        files = {f"thesis/figure-{number}.png": partial(save_figure, number, drawn) for number in FIGURES}
        return Answer(text=text, files={"thesis.md": text} | files)

    def check(self) -> None:
        """Refuse to write over a page of something else."""
        if self.page is not None and self.page.is_file():
            first = self.page.read_text(encoding="utf-8", errors="replace").partition("\n")[0]
            if first != TITLE:
                raise SpringfootError(f"{self.page} is another page: this study writes a whole one, titled {TITLE!r}")

    def write_page(self, page: Path, answer: Answer) -> None:
        """Write the whole page."""
        write_atomically(page, answer.text.encode())
