"""Save and restore the exact state of a batch, as plain arrays and JSON values, to continue with the same bits."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError

FEET = "feet"
"""Entry of a state with drawn and given feet."""


class ExactState(ABC):
    """Save and restore the state of N environments; pickle and deepcopy make the batch anew and use both.

    A copy has the arguments and the state of the original, and generators of its own; nothing listens to its ticks.
    """

    _arguments: dict[str, Any]
    """Arguments that made the batch."""
    _kept: Mapping[str, NDArray]
    """Name -> array with N rows, of numbers or of records, of everything that changes."""
    _random: list[np.random.Generator | None]
    """(N,) the generator of each environment."""

    @abstractmethod
    def _embody(self, ids: NDArray, numbers: Mapping[str, NDArray], feet: Any) -> None:
        """Give environments `ids` (K,) the bodies of the state's `numbers`, and its `feet`, their own if None.

        Raises `SpringfootError`, with nothing changed, for feet that do not fit.
        """

    @abstractmethod
    def _rewrite_numbers(self, ids: NDArray) -> None:
        """Write again the numbers of environments `ids` (K,) that depend on the batch, over those of the state."""

    @abstractmethod
    def _feet_of(self, ids: NDArray) -> list[Any] | None:
        """Return K pairs of feet in JSON values that replace those of environments `ids` (K,); None if none do."""

    @property
    def generators(self) -> list[np.random.Generator | None]:
        """Return the generator of each environment, None before its first reset; the list itself, which may be
        changed."""
        return self._random

    def state(self, ids: NDArray | None = None) -> dict[str, Any]:
        """Return the exact state of environments `ids` (K,), of all if None, between two steps.

        Arrays (K, ...) by name, copies; and `generators`, K states of NumPy's bit generators in JSON values. Where a
        reset draws or sets feet, `feet` are K pairs of them in JSON values, None for an environment's own.
        """
        chosen = np.arange(len(self._random)) if ids is None else ids
        generators = [None if random is None else random.bit_generator.state for random in self._random]
        state: dict[str, Any] = {name: values[chosen] for name, values in self._numbers()}
        feet = self._feet_of(chosen)
        state |= {} if feet is None else {FEET: feet}
        return state | {"generators": [generators[index] for index in chosen.tolist()]}

    def restore(self, state: Mapping[str, Any], ids: NDArray | None = None) -> None:
        """Put environments `ids` (K,), all if None, into the state of K environments of a batch of the same settings.

        From then on they behave bit for bit like the environments of that state. Generators change in place. Raises
        `SpringfootError`, leaving all state unchanged, for a state of other names, shapes or generators; a state has no
        settings, and they are not compared.
        """
        chosen = np.arange(len(self._random)) if ids is None else ids
        numbers = dict(self._numbers())
        expected = {name: (len(chosen), *values.shape[1:]) for name, values in numbers.items()}
        # Feet that a reset gave are in the state alone, and none are in it where they are the environments' own.
        optional = {FEET} if self._arguments["settings"].drawn_feet is None else set()
        for name in ({*expected, "generators", FEET} ^ set(state)) - optional:  # names that only one of the two has
            raise SpringfootError(f"the state does not fit these settings: {name!r} is in one of them only")
        for name, shape in expected.items():
            if np.shape(state[name]) != shape:
                raise SpringfootError(f"the state does not fit: {name!r} must be {shape}, got {np.shape(state[name])}")
        if len(state["generators"]) != len(chosen):
            raise SpringfootError(f"the state does not fit: {len(chosen)} generators, got {len(state['generators'])}")
        try:
            restored = {name: np.asarray(state[name]).astype(values.dtype) for name, values in numbers.items()}
            for generator_state in state["generators"]:
                _generator(None, generator_state)  # raises for a bad one
        except (AttributeError, KeyError, TypeError, ValueError) as error:  # the first: NumPy has no such generator
            raise SpringfootError(f"the state does not fit: {' '.join(str(error).split())}") from None
        self._embody(chosen, restored, state.get(FEET))
        for name, values in numbers.items():
            values[chosen] = restored[name]
        self._rewrite_numbers(chosen)
        for index, generator_state in zip(chosen.tolist(), state["generators"], strict=True):
            self._random[index] = _generator(self._random[index], generator_state)

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickled, (type(self), self._arguments, self.state())

    def _numbers(self) -> Iterator[tuple[str, NDArray]]:
        """Yield name and view (N, ...) of every array of numbers that changes."""
        for name, rows in self._kept.items():
            yield from _fields(name, rows)


def _fields(name: str, rows: NDArray) -> Iterator[tuple[str, NDArray]]:
    """Yield name and view of every field of numbers in an array of records, at all levels: `name.field.field`."""
    if rows.dtype.names is None:  # numbers, no records
        yield name, rows
    for field in rows.dtype.names or ():
        yield from _fields(f"{name}.{field}", rows[field])


def _generator(present: np.random.Generator | None, state: Mapping[str, Any] | None) -> np.random.Generator | None:
    """Return a generator in `state`, the state of a NumPy bit generator in JSON values; None for None.

    It is the `present` generator, put into that state, if that is of the same kind; else a new one.
    """
    if state is None:
        return None
    kind = getattr(np.random, state["bit_generator"])
    if not (isinstance(kind, type) and issubclass(kind, np.random.BitGenerator)):
        raise ValueError(f"{state['bit_generator']} is no bit generator of NumPy's")
    if present is None or type(present.bit_generator) is not kind:
        present = np.random.Generator(kind())
    present.bit_generator.state = dict(state)
    return present


def _unpickled(kind: type[ExactState], arguments: dict[str, Any], state: dict[str, Any]) -> ExactState:
    """Return a new batch of the class `kind` with these arguments, in this state."""
    batch = kind(**arguments)
    batch.restore(state)
    return batch
