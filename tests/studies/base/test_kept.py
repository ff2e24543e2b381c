"""Kept results: a question is answered once, and again when it is another."""

import json

from springfoot.studies.base.kept import Kept, known_as


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


def test_of_several_questions_those_without_an_answer_are_made_together(tmp_path):
    kept, asked = Kept(tmp_path / "kept.json"), []
    kept.get("b", lambda: {"value": 1})

    def make(missing: list[int]) -> list[dict]:
        asked.append(missing)
        return [{"value": 10 * index} for index in missing]

    expected = [{"value": 0}, {"value": 1}, {"value": 20}]
    assert (
        kept.get_all(["a", "b", "c"], make) == Kept(tmp_path / "kept.json").get_all(["a", "b", "c"], make) == expected
    )
    assert asked == [[0, 2]]


def test_a_policy_is_known_by_its_files_content(tmp_path):
    files = [tmp_path / "a.safetensors", tmp_path / "b.safetensors"]
    for file, content in zip(files, (b"one", b"another"), strict=True):
        file.write_bytes(content)
    (_, first), (_, second) = map(known_as, map(str, files))
    assert first != second
    files[0].write_bytes(b"another")
    assert known_as(str(files[0])) == [str(files[0]), second]
    assert known_as("constant:300,40") == ["constant:300,40"]
