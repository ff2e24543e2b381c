"""Show how much the price of a walk changes with numbers known roughly: two tendons, and the rise of K with torque.

    springfoot study price

Prices are of the same recorded walks, and of the plan. The reward term `stiffness` is read on walks with the setting
`ankle_tendon`, which bounds K, so for each tendon the body walks anew.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from springfoot.envs.control import TUNED_SPEED
from springfoot.envs.physics import JOINTS
from springfoot.evaluation.numbers import measure, stiffness_charge
from springfoot.evaluation.recording import Recording, policy_and_settings, record
from springfoot.files.markdown import MISSING, table, text_of
from springfoot.gait import GRAVITY, Body
from springfoot.gait.body import ANKLE_TENDON
from springfoot.gait.plan import AS_IS, Muscle, effort_of, least_work, plan_walk

from ..base.study import Answer, OnProgress, WalkingStudy
from ..base.walked_speeds import TWO_PRICES, Row, rows_csv

FACTORS = (0.5, 1.0, 2.0)
"""Factors on each number."""
AS_KNOWN = "as it is"
TENDONS: dict[str, Muscle] = {
    f"{joint}'s tendon × {factor:g}": Muscle(**{give: 1.0 / factor})
    for joint, give in (("ankle", "tendon"), ("toe", "toe_tendon"))
    for factor in FACTORS
    if factor != 1.0
}
"""Name of a case -> muscles with a tendon of another stiffness."""
CASES = {AS_KNOWN: AS_IS, **TENDONS}
"""Name of each case -> its muscles."""
CHARGES = {"torque": "rise of K with torque", "tendon": "`ankle_tendon`"}
"""Number on which the charge of K hangs -> its words."""
THE_PLAN = "the plan"


@dataclass(frozen=True, kw_only=True)
class Price(WalkingStudy):
    """Price walks with tendons half and twice as stiff, and read the charge of K."""

    policies: tuple[str, ...] = ("schedule", "predicted", "pretrained")
    """Policies with walks that are priced."""
    episodes: int = 5
    """Episodes of each walk."""
    seconds: float = 12.0
    """Length of each episode."""

    QUICK: ClassVar[Mapping[str, Any]] = {"episodes": 1, "seconds": 5.0}

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        return len(self.policies) * (1 + len(FACTORS)) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk with every policy, and price its walk and the plan."""
        prices: list[Row] = []
        charges: list[Row] = []
        for name in self.policies:
            prices += prices_of(name, self._walk(name, None, progress))
            bound = {factor: self._walk(name, factor * ANKLE_TENDON, progress) for factor in FACTORS}
            charges += charges_of(name, bound)
        prices += plan_prices()
        files = {"prices.csv": rows_csv(prices), "charges.csv": rows_csv(charges)}
        return Answer(text=f"{price_table(prices, charges)}\n\n{self.what_ran} of each walk.", files=files)

    def _walk(self, name: str, tendon: float | None, progress: OnProgress) -> Recording:
        """Record a policy's walk with the setting `ankle_tendon` [N m/rad]."""
        act, settings = policy_and_settings(name, {"ankle_tendon": tendon, "episode_seconds": self.seconds})
        return record(act, settings, name=name, progress=progress, **self.how)


def prices_of(name: str, recording: Recording) -> list[Row]:
    """Return a row for each case: both prices of a recorded walk, and the fibre work of each joint [J/kg/m]."""
    rows = []
    for case, muscle in CASES.items():
        metrics = measure(recording, muscle).metrics
        effort = metrics["effort"]
        row = {"walk": name, "case": case, "falls": metrics["falls"] / metrics["episodes"]}
        row |= {"fibre_J_kg_m": effort["fibre_J_kg_m"], "effort": effort["total"]}
        rows.append(row | {joint: effort["per_joint"][joint]["fibre_J_kg_m"] for joint in JOINTS})
    return rows


def plan_prices() -> list[Row]:
    """Return the rows of `prices_of` for the plan of least effort, without the work of single joints."""
    plan = plan_walk(Body(), TUNED_SPEED, style=least_work(TUNED_SPEED))
    rows = []
    for case, muscle in CASES.items():
        effort = effort_of(plan, muscle)
        row = {
            "walk": THE_PLAN,
            "case": case,
            "falls": 0.0,
            "fibre_J_kg_m": effort.work * GRAVITY,
            "effort": effort.total,
        }
        rows.append(row | dict.fromkeys(JOINTS))
    return rows


def charges_of(name: str, bound: Mapping[float, Recording]) -> list[Row]:
    """Return a row for each number of `CHARGES` and factor: the mean of the reward term `stiffness`.

    `bound` are walks of a policy with each factor on `ANKLE_TENDON`.
    """
    of_torque = {factor: stiffness_charge(bound[1.0], factor) for factor in FACTORS}
    of_tendon = {factor: stiffness_charge(recording) for factor, recording in bound.items()}
    return [
        {"walk": name, "number": number, "factor": factor, "charge": charge}
        for number, charges in zip(CHARGES, (of_torque, of_tendon), strict=True)
        for factor, charge in charges.items()
    ]


def price_table(prices: Sequence[Row], charges: Sequence[Row]) -> str:
    """Return the Markdown table of prices (rows of `prices_of`), their change with each tendon of `TENDONS`, and the
    charge of K with each factor (rows of `charges_of`)."""
    priced = {(row["walk"], row["case"]): row for row in prices}
    walks = list(dict.fromkeys(row["walk"] for row in prices))
    lines = [[AS_KNOWN, *(_price_cell(priced[walk, AS_KNOWN]) for walk in walks)]]
    for case in TENDONS:
        lines.append([case, *(_change_cell(priced[walk, case], priced[walk, AS_KNOWN]) for walk in walks)])
    factors = " / ".join(f"× {factor:g}" for factor in FACTORS)
    for number, words in CHARGES.items():
        cells = []
        for walk in walks:
            charged = [row["charge"] for row in charges if (row["walk"], row["number"]) == (walk, number)]
            cells.append(" / ".join(f"{charge:.1f}" for charge in charged) or MISSING)
        lines.append([f"`stiffness`, {words} {factors}", *cells])
    note = (
        "Fibre work [J/kg/m] / all of effort [-], in brackets the parts of ankle and toe in the fibre work; below, "
        f"changes. `stiffness`: mean of the reward's term with `ankle_tendon` {ANKLE_TENDON:g}."
    )
    return f"{table(['', *walks], lines)}\n\n{note}"


def _price_cell(row: Row) -> str:
    """Return the cell of a walk: fibre work / effort, and in brackets the fibre work of ankle and toe unless None."""
    prices = " / ".join(text_of(row[price], ".2f") for price in TWO_PRICES)
    return prices if row["toe"] is None else f"{prices} ({row['ankle']:.2f}, {row['toe']:.2f})"


def _change_cell(row: Row, unchanged: Row) -> str:
    """Return the change of both prices from the row of the unchanged tendons, in percent; a dash without prices."""
    if row[TWO_PRICES[0]] is None:
        return MISSING
    return " / ".join(f"{row[price] / unchanged[price] - 1.0:+.0%}" for price in TWO_PRICES)
