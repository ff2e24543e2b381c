"""Keep a study's results in a file, so that a stopped study goes on without computing them again."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from springfoot.agents.policies import find_policy
from springfoot.errors import SpringfootError
from springfoot.files.json_file import read_object
from springfoot.files.tensor_file import digest_of_file
from springfoot.files.writing import write_atomically


class Kept:
    """Results of a study by question, kept in the JSON file `path`; in memory only if that is None.

    Raises `SpringfootError` for a file of another kind.
    """

    def __init__(self, path: Path | None):
        self._path = path
        self._results: dict[str, Any] = {}
        if path is not None and path.exists():
            self._results = read_object(path, "file of a study's numbers")
            if not all(isinstance(result, dict) for result in self._results.values()):
                raise SpringfootError(f"{path} is no file of a study's numbers: each must be an object in braces")

    def get(self, question: Any, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """Return the kept result for `question`, any JSON value; call `make` for it and keep it if there is none."""
        (result,) = self.get_all([question], lambda _: [make()])
        return result

    def get_all(
        self, questions: Sequence[Any], make: Callable[[list[int]], Sequence[dict[str, Any]]]
    ) -> list[dict[str, Any]]:
        """Return the result for each question, in order; call `make` once for all that are not kept, and keep those.

        `make` gets the indices of the missing questions, and returns their results.
        """
        texts = [json.dumps(question, sort_keys=True) for question in questions]
        missing = [index for index, text in enumerate(texts) if text not in self._results]
        if missing:
            self._results |= zip([texts[index] for index in missing], make(missing), strict=True)
            if self._path is not None:
                self._path.parent.mkdir(parents=True, exist_ok=True)
                write_atomically(self._path, (json.dumps(self._results, indent=1) + "\n").encode())
        return [self._results[text] for text in texts]


def known_as(policy: str) -> list[str]:
    """Return the words of a question for a policy: its name, and its file's digest if it has a file, since a policy
    trained anew under the same name walks otherwise."""
    try:
        return [policy, digest_of_file(find_policy(policy))]
    except SpringfootError:  # a baseline, a function, a copy
        return [policy]
