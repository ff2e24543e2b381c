"""The sections of docs/thesis.md that are tables; each a function that gives its markdown, every number computed."""

from functools import cache

import numpy as np

from springfoot.arrays import NDArray
from springfoot.files.markdown import table
from springfoot.gait import GRAVITY, Body, WalkPlan, human_gait, plan_walk
from springfoot.gait.people.scores import correlation, force_features, positive_work
from springfoot.gait.plan.kinetics import (
    foot_force,
    inverse_dynamics,
    people_leg,
    planned_leg,
    planned_moments,
    projection_table,
)
from springfoot.gait.plan.plan import DOUBLE_SUPPORT
from springfoot.gait.plan.thesis import ThesisWalk
from springfoot.gait.springs.quasi_stiffness import ankle_quasi_stiffness
from springfoot.gait.springs.stiffness import schedule_from_curves

from .thesis_figures import of_people

BODY, THESIS_SPEED = Body(), 1.2
DOUBLE_SUPPORTS = (0.03, 0.06, 0.09, 0.12, 0.15)
"""T_d of the cart-table's table [s]."""
TRAVELS = ((0.0, 0.11), (-0.02, 0.14), (-0.08, 0.165))
"""Its ZMP travels: start and end of single support, forward of the stance ankle [m]; the default plan's in the
middle."""
ANGLE_NOISE = np.radians(0.5)
"""Of a good gait laboratory [rad]."""
STRIDE = np.arange(1000) / 1000
PHASES = np.arange(101) / 100


@cache
def corrected() -> WalkPlan:
    """The plan with the thesis's step: 0.6 m, 0.5 s, T_d = 0.06 s."""
    return plan_walk(BODY, THESIS_SPEED, "thesis")


def claims() -> str:
    """Each claim of the thesis beside ours and people's."""
    plan, human = corrected(), human_gait(THESIS_SPEED)
    ours, people = (_features(plan), _people_features())
    toe, ankle = (np.degrees(plan.joint_angles(STRIDE)[joint]) for joint in ("toe", "ankle"))
    people_toe, people_ankle = (np.degrees(human.mean(joint, STRIDE)) for joint in ("toe", "ankle"))
    flat = (plan.feet.foot_flat < STRIDE) & (plan.feet.heel_off > STRIDE)
    people_flat = (STRIDE > 0.15) & (STRIDE < 0.35)
    moment = planned_moments(plan, STRIDE)["ankle"] / BODY.mass
    torque = ThesisWalk().joint_torque("ankle", np.linspace(0.5, 1.25, 751)) / BODY.mass
    rms = [_rms_deg(plan, joint) for joint in ("thigh", "knee", "ankle")]
    up = 100 * plan.com_acceleration(STRIDE)[1] / GRAVITY
    people_up = 100 * (of_people(THESIS_SPEED, BODY).force[1] - 1)
    stance = 50 + 50 * ThesisWalk().double_support / ThesisWalk().step_time
    needed = (0.62 - 0.5) * plan.stride_time
    rows = [
        (
            "vertical force 80–120 %, people's 80–110 %",
            "{2:.2f}/{3:.2f}/{4:.2f}".format(*ours),
            "{2:.2f}/{3:.2f}/{4:.2f}".format(*people),
            "hump/valley/hump of one foot; the thesis has one mass on both",
        ),
        (
            "fore-aft force 70 %, people's 20 %",
            "{:+.2f}/{:+.2f}".format(*ours),
            "{:+.2f}/{:+.2f}".format(*people),
            "its knots; what is left, in the next section",
        ),
        (
            "acceleration in z is too small to count (2.2)",
            f"{up.min():+.0f} … {up.max():+.0f} % of g",
            f"{people_up.min():+.0f} … {people_up.max():+.0f} % of g",
            "it is the whole shape of the vertical force (both feet)",
        ),
        (
            f"stance is 62 % of the cycle; its T_d gives {stance:.0f} %",
            f"{100 * plan.feet.toe_off:.0f} %",
            f"{100 * human.toe_off:.0f} %",
            f"62 % needs T_d = {needed:.2f} s; people take {_people_double_support():.3f} s",
        ),
        (
            "the cycle lasts 0.75 s (the figures' axis)",
            f"{plan.stride_time:.2f} s",
            f"{human.stride_time:.2f} s",
            "t_nor_cyc divides by k T_c + T_m",
        ),
        (
            "ankle −7.5° at foot flat (so q_f = 0.13)",
            f"{ankle[STRIDE < 0.2].min():.1f}°",
            f"{people_ankle[STRIDE < 0.2].min():.1f}°",
            "lowest of the first 20 %; the plan keeps q_f, its shank leans",
        ),
        (
            "toe peak 23° (so q_b = 0.40)",
            f"{toe.max():.0f}°",
            f"{people_toe.max():.0f}°",
            "the plan's toe lies flat until it leaves, people's tips over; 23° is one measurement",
        ),
        (
            "toe locked from foot flat to heel-off",
            f"{np.ptp(toe[flat]):.1f}°",
            f"{np.ptp(people_toe[people_flat]):.1f}°",
            "range of its angle there",
        ),
        (
            f"joint torque: none (its formulas: ankle {torque.min():+.1f} … {torque.max():+.1f} N·m/kg)",
            f"{moment.max():.2f} N·m/kg",
            f"{human.mean('ankle_moment', STRIDE).max():.2f} N·m/kg",
            "ankle's peak; the sine twice, on a ZMP far off, with the whole force in swing too",
        ),
        (
            "joint angles: none",
            "/".join(f"{error:.1f}°" for error in rms),
            "–",
            "RMSE of thigh/knee/ankle to people's",
        ),
        (
            "effect of stiffness, animation, contact: none",
            "[README](../README.md)",
            "–",
            "needs a simulated body; there is one",
        ),
    ]
    return "## Claims\n\n" + table(("the thesis", "corrected", "people", "why"), rows)


def cart_table() -> str:
    """What forces a cart-table plan can have."""
    step_time = human_gait(THESIS_SPEED).stride_time / 2
    own = [plan_walk(BODY, THESIS_SPEED, double_support=each) for each in DOUBLE_SUPPORTS]
    rows, push_off = [], []
    for double_support, shifted in zip(DOUBLE_SUPPORTS, own, strict=True):
        plans = [plan_walk(BODY, THESIS_SPEED, double_support=double_support, zmp_travel=travel) for travel in TRAVELS]
        push_off.append(_features(plans[1])[1])
        cells = [_five(_features(plan)) for plan in plans]
        rows.append((f"{double_support:.2f}", *cells, *(f"{_rms_deg(p, 'knee'):.0f}°" for p in (plans[1], shifted))))
    people = _people_features()
    rows.append((f"people, {_people_double_support():.3f}", _five(people), "", "", "–", "–"))
    # Valley of a cosine: 1 - a (2 pi / T)^2 / g.
    amplitude = (1 - people[3]) * GRAVITY * (step_time / (2 * np.pi)) ** 2
    shallow = _features(plan_walk(BODY, THESIS_SPEED, double_support=DOUBLE_SUPPORTS[-1], com_amplitude=amplitude))
    rise = 1000 * np.ptp(of_people(THESIS_SPEED, BODY).com_wave[1])
    enough = float(np.interp(-people[1], -np.array(push_off), DOUBLE_SUPPORTS))
    travels = [f"ZMP {100 * start:.3g} → {100 * end:.3g} cm" for start, end in TRAVELS]
    behind = [100 * _hip_behind(plan) for plan in own]
    head = ("T_d (s)", *travels, "knee", "knee, shifted")
    return f"""## What a cart-table model can reach

One foot's fore-aft peaks and vertical hump/valley/hump, body weights, at people's step ({step_time:.2f} s), by double
support and by the ZMP's travel in single support (from the stance ankle; the default plan's in the middle); then RMSE
of the middle plan's knee to people's, and of the knee where the planner chooses the travel: the middle one up to
{DOUBLE_SUPPORT * step_time:.2f} s, shifted forward in longer ones.

{table(head, rows)}

It **can** have people's fore-aft peaks: longer double support and longer travel of the ZMP both lower them, and at the
middle travel people's {people[1]:.2f} takes T_d = {enough:.2f} s, about their own. It **cannot** have people's knees
with it. In a long double support the rear toe rolls over its tip, as people's does, so that the CoM need not come down
as far as over a flat toe; and the ZMP's travel shifts forward, near people's, and the hip with it. But people's angles
and people's ZMP disagree under an upright trunk: over the shifted one the hip of mid-stance is {behind[-2]:.1f} (T_d =
{DOUBLE_SUPPORTS[-2]:.2f} s) and {behind[-1]:.1f} cm ({DOUBLE_SUPPORTS[-1]:.2f} s) behind where people's angles put it,
and knee and ankle make up for it. Braking and push-off come out alike, where people push harder than they brake.

The height is one cosine, so valley and humps are one choice: people's valley of {people[3]:.2f} means a rise of
{2000 * amplitude:.0f} mm and humps of {shallow[2]:.2f} and {shallow[4]:.2f} (T_d = {DOUBLE_SUPPORTS[-1]:.2f} s); people
rise {rise:.0f} mm and have {people[2]:.2f} and {people[4]:.2f}. Their first hump, lower than the second, stands in
single support: no single cosine does that."""


def moments() -> str:
    """GRF projection against inverse dynamics, per joint, stance and swing."""
    human = human_gait(THESIS_SPEED)
    people, planned = people_leg(human, BODY, STRIDE), planned_leg(corrected(), STRIDE)
    rows = [
        (a.joint, a.part, *(f"{e.rms:.3f}, {e.peak:.3f}" + (f", {e.r:.3f}" if e.r is not None else "") for e in (a, b)))
        for a, b in zip(projection_table(BODY, *people), projection_table(BODY, *planned), strict=True)
    ]
    computed = inverse_dynamics(BODY, *people).moment
    r = {
        joint: correlation(computed[joint] / BODY.mass, human.mean(f"{joint}_moment", STRIDE))
        for joint in ("hip", "knee", "ankle")
    }
    return f"""## Torque from the ground reaction force, against inverse dynamics

The thesis takes from Wells (1981) that the two are almost the same. GRF projection, equation (3), minus Newton–Euler
inverse dynamics of the same motion and forces: rms and largest difference (N·m/kg), and r.

{table(("joint", "", "people", "corrected plan"), rows)}

At ankle and toe it is true always, and these are the joints the thesis needs: its shortcut was sound, its forces were
not. At the knee it is true in stance; in swing the projection is 0 and the moment is not. At the hip it is not true
even in stance: the leg's own inertia counts, and most where the plan's feet change quickly. Inverse dynamics of
people's mean curves (this body, one subject's centre of pressure) against their measured moments: r =
{", ".join(f"{value:.2f} {joint}" for joint, value in r.items())}."""


def springs() -> str:
    """Lines between events, and identified springs beside published quasi-stiffness."""
    plan, human = corrected(), human_gait(THESIS_SPEED)
    phase = np.linspace(0.0, human.toe_off, 1001)
    torque = -human.mean("ankle_moment", phase)
    people = schedule_from_curves(phase, human.toe_off, (human.mean("ankle", phase), torque)).ankle
    stance = np.linspace(0.0, plan.feet.toe_off, 1001)
    angles = plan.joint_angles(stance)
    taken = {joint: moment / BODY.mass for joint, moment in planned_moments(plan, stance).items()}
    ours = schedule_from_curves(stance, plan.feet.toe_off, (angles["ankle"], -taken["ankle"])).ankle
    most = int(taken["toe"].argmax())
    toe = taken["toe"][most] / angles["toe"][most]
    names = ("heel strike → foot flat", "foot flat → maximum dorsiflexion", "maximum dorsiflexion → toe-off")
    lines = [
        (f"ankle, {name}", f"{a.stiffness:.2f}", f"{b.stiffness:.2f}")
        for name, a, b in zip(names, people[:3], ours[:3], strict=True)
    ]
    lines.append(("toe, heel-off → largest moment", "not measured", f"{toe:.2f}"))
    phases = []
    for row in ankle_quasi_stiffness():
        k, beta = row.identified.stiffness, row.identified.damping_time
        phases.append(
            (
                f"{row.phase}, {100 * row.start:.0f}–{100 * row.end:.0f} %",
                f"{row.slope:.2f}",
                f"{k.value:.2f} [{k.low:.2f}, {k.high:.2f}]" if k else "–",
                f"{1000 * beta.value:+.0f}" if beta else "–",
                f"{100 * (row.identified.attenuation(ANGLE_NOISE) - 1):+.2g} %",
                f"{row.published:.2f} ± {row.published_sd:.2f}",
            )
        )
    head = ("phase", "slope, people's mean curve", "K identified [95 %]", "β (ms)", "bias of K", "Fukuchi, median ± SD")
    return f"""## Stiffness

The values read off the thesis's Figure 5 are not in its text. Straight lines between its events, equation (4), in
N·m/(rad·kg), 0 in swing:

{table(("line", "people", "corrected plan"), lines)}

Foot flat to maximum dorsiflexion agrees. The plan loads its heel in {plan.double_support:.2f} s, so its first line is
steep; its force runs out to the toe's tip with the toe flat, so its toe is {BODY.mass * toe:.0f} N·m/rad for
{BODY.mass:.0f} kg, where barefoot estimates are 25 to 60.

Ankle per phase of another laboratory's adults (overground, 1.1–1.3 m/s: Fukuchi et al., PeerJ 6:e4640, slopes per trial
from DJS-GA). The bias is what white noise of {np.degrees(ANGLE_NOISE):.1f}° on the angle would do to K:

{table(head, phases)}

The rising phases agree. Controlled plantarflexion is short and depends on where foot flat is put; mean curves blur
push-off. A negative β is no damper: the muscle does work there, or its stiffness is not constant. Residuals are
correlated from sample to sample, so that these intervals are too narrow. All of these are slopes of a loop, of an
undisturbed gait: the joint's own stiffness only if its rest angle stood still, which nobody knows. Of the simulated
walk, whose rest angle moves, the same estimator misses the stiffness by half ([results.md](results.md),
Identification)."""


def people_work() -> dict[str, float]:
    """Positive joint work of one leg of people a stride [J/kg]."""
    human = human_gait(THESIS_SPEED)
    tick = human.stride_time / len(STRIDE)
    return {
        joint: float(positive_work(human.mean(f"{joint}_power", STRIDE), tick)) for joint in ("hip", "knee", "ankle")
    }


def _rms_deg(plan: WalkPlan, joint: str) -> float:
    error = plan.joint_angles(STRIDE)[joint] - human_gait(THESIS_SPEED).mean(joint, STRIDE)
    return float(np.degrees(np.sqrt(np.mean(error**2))))


def _hip_behind(plan: WalkPlan) -> float:
    """How far the hip is behind where people's angles put it over a flat foot, mean of mid-stance [m]."""
    stance = np.linspace(0.1, 0.4, 100)
    thigh, knee = (human_gait(THESIS_SPEED).mean(joint, stance) for joint in ("thigh", "knee"))
    of_people = -BODY.thigh_length * np.sin(thigh) - BODY.shank_length * np.sin(thigh - knee)
    return float(np.mean(of_people - plan.hip_position(stance)[0]))


def _people_double_support() -> float:
    human = human_gait(THESIS_SPEED)
    return (human.toe_off - 0.5) * human.stride_time


def _features(plan: WalkPlan) -> tuple[float, ...]:
    """Braking and push-off peak, first hump, valley, second hump of one foot [body weights]."""
    return _peaks(foot_force(plan, PHASES)[0].T / (plan.body.mass * GRAVITY))


def _people_features() -> tuple[float, ...]:
    human = human_gait(THESIS_SPEED)
    return _peaks(np.stack([human.mean(f"grf_{name}", PHASES) for name in ("forward", "vertical")]))


def _peaks(force: NDArray) -> tuple[float, ...]:
    f = force_features(force[1], force[0])
    peaks = f.braking_peak, f.forward_peak, f.vertical_peak1, f.vertical_valley, f.vertical_peak2
    return tuple(peak for peak in peaks if peak is not None)


def _five(features: tuple[float, ...]) -> str:
    return "{:+.2f}/{:+.2f}; {:.2f}/{:.2f}/{:.2f}".format(*features)
