"""Kept results: a question is answered once, and again when it is another."""

import json

from springfoot.studies.base.kept import Kept


def test_what_was_measured_is_kept(tmp_path):
    path, made = tmp_path / "runs" / "kept.json", []

    def make() -> dict:
        made.append(1)
        return {"falls": 0.5}

    for _ in range(2):
        assert Kept(path).get(["a", 1], make) == {"falls": 0.5}
    assert len(made) == 1
    Kept(path).get(["a", 2], make)
    assert len(made) == 2
    assert len(json.loads(path.read_text())) == 2
