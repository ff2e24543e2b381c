"""The package as others get it: complete, importable floor by floor, free of anyone's paths."""

import json
import posixpath
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import venv
import zipfile
from email import message_from_string
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

import setup
import springfoot
from springfoot.cli.main import main
from springfoot.extras import EXTRA_OF

ROOT = Path(__file__).parents[2]
ROOMS = ("files", "gait", "envs", "agents", "evaluation", "studies", "cli", "examples")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
RECIPE = (ROOT / "recipes" / "recipe.yaml").read_text()
EXTRAS = ("evaluate", "train", "dev")
"""Extras of `make install`."""


def files(*folders):
    """Our files under `folders`, relative to the root, without caches and hidden ones."""
    found = (path.relative_to(ROOT) for folder in folders for path in (ROOT / folder).rglob("*"))
    return sorted(
        path
        for path in found
        if (ROOT / path).is_file() and not any(part == "__pycache__" or part[0] == "." for part in path.parts)
    )


def run(code, cwd=None):
    done = subprocess.run([sys.executable, "-c", code], cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_package_folder_is_listed():
    folders = {path.parent.as_posix() for path in files(*ROOMS) if path.name == "__init__.py"}
    expected = {"springfoot": "package"} | {"springfoot." + folder.replace("/", "."): folder for folder in folders}
    expected["springfoot.docs"] = "docs"  # pages, no code
    listed = PROJECT["tool"]["setuptools"]
    assert listed["package-dir"] == expected
    assert sorted(listed["packages"]) == sorted(expected)


GENERATED = re.compile(r"PKG-INFO|setup\.cfg|springfoot\.egg-info/.*")
"""What a source distribution has besides the files it is made from."""


@pytest.fixture(scope="module")
def known():
    """What git knows of this folder, or what the list of an unpacked source distribution names."""
    if (ROOT / ".git").exists():
        command = ["git", "ls-files", "-z"]
        names = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\0")
    else:
        names = (ROOT / "springfoot.egg-info" / "SOURCES.txt").read_text().splitlines()
    return sorted(name for name in names if (ROOT / name).is_file() and not GENERATED.fullmatch(name))


@pytest.fixture(scope="module")
def sdist(known, tmp_path_factory):
    """The source distribution of what is known, unpacked."""
    source, unpacked = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("sdist")
    for name in known:
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, source / name)
    run("from setuptools import build_meta; build_meta.build_sdist('.')", cwd=source)
    (packed,) = source.glob("springfoot-*.tar.gz")
    with tarfile.open(packed) as archive:
        archive.extractall(unpacked, filter="data")
    (folder,) = unpacked.iterdir()
    return folder


@pytest.fixture(scope="module")
def wheel(sdist):
    """The wheel that is built from that source distribution."""
    run("from setuptools import build_meta; build_meta.build_wheel('.')", cwd=sdist)
    (packed,) = sdist.glob("*.whl")
    packed = packed.rename(sdist.parent / packed.name)
    shutil.rmtree(sdist / "build", ignore_errors=True)
    return packed


@pytest.fixture(scope="module")
def metadata(wheel):
    """What a package index is told."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        return message_from_string(archive.read(name).decode())


def test_source_distribution_holds_all_that_git_knows(sdist, known):
    held = (path.relative_to(sdist).as_posix() for path in sdist.rglob("*") if path.is_file())
    assert sorted(name for name in held if not GENERATED.fullmatch(name)) == known


def test_wheel_holds_every_file_of_the_rooms(wheel, known):
    packed = [name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name]
    ours = [name.removeprefix("package/") for name in known if name.partition("/")[0] in ("package", *ROOMS)]
    ours += [
        name for name in known if re.fullmatch(r"docs/.+\.(md|csv|json)|docs/generate\.py", name)
    ]  # pages and their maker
    assert sorted(packed) == sorted(f"springfoot/{name}" for name in ours)
    assert "springfoot/py.typed" in packed


def test_pages_in_the_wheel_lead_to_what_it_holds(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        pages = {name: archive.read(name).decode() for name in names if name.endswith(".md") and "/docs/" in name}
    assert len(pages) > 20
    dead = [
        (name, link)
        for name, page in pages.items()
        for link in re.findall(r"\]\(([^)#]+)", page)
        if not link.startswith("https://") and posixpath.normpath(f"{posixpath.dirname(name)}/{link}") not in names
    ]
    assert dead == []
    live = pages["springfoot/docs/how-to/live.md"]
    assert "[learned person](person.md)" in live and "png)" not in live and "\nwalks.html is one file" in live


def test_links_that_a_page_keeps_and_those_that_lead_to_the_repository():
    page = "![The body](../live.png) and [a person](person.md#train)"
    text = setup.linked(page, "https://host/it", "0.1.0", "docs/how-to", lambda path: path.startswith("person.md"))
    assert text == "![The body](https://host/it/raw/v0.1.0/docs/live.png) and [a person](person.md#train)"
    assert setup.linked(page, None, "0.1.0") == "*The body* and a person"


def test_the_version_stands_once(metadata, capsys):
    assert "version" in PROJECT["project"]["dynamic"]
    assert version("springfoot") == metadata["Version"] == springfoot.__version__
    assert main(["--version"]) == 0 and capsys.readouterr().out == f"springfoot {springfoot.__version__}\n"
    assert f"\nversion: {springfoot.__version__}\n" in (ROOT / "CITATION.cff").read_text()  # a format without imports
    assert f"\n  version: {springfoot.__version__}\n" in RECIPE


def test_the_package_runs_as_the_command():
    done = subprocess.run([sys.executable, "-m", "springfoot", "--version"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, f"springfoot {springfoot.__version__}\n")


def test_the_conda_recipe_needs_what_the_wheel_needs():
    theirs = {"matplotlib": "matplotlib-base", "mujoco": "mujoco-python"}
    project = PROJECT["project"]
    lines = map(Requirement, [*project["dependencies"], *project["optional-dependencies"]["evaluate"]])
    needed = {theirs.get(one.name, one.name): one.specifier for one in lines}
    needed["python"] = SpecifierSet(project["requires-python"])
    run = re.findall(r"- (\S+) (\S+)\n", RECIPE.partition("\n  run:")[2].partition("tests:")[0])
    assert {name: SpecifierSet(versions) for name, versions in run} == needed
    assert f"setuptools {PROJECT['build-system']['requires'][0].removeprefix('setuptools')}\n" in RECIPE


def test_the_image_gets_every_folder_that_the_package_is_made_of():
    kept = (ROOT / "recipes" / "Dockerfile.dockerignore").read_text().splitlines()
    folders = {place.split("/")[0] for place in PROJECT["tool"]["setuptools"]["package-dir"].values()}
    assert {f"!{folder}" for folder in folders} <= set(kept)


def test_a_release_has_an_address_and_says_what_changed():
    released = "dev" not in springfoot.__version__
    assert not released or not PROJECT["project"]["urls"]["Source"].startswith("https://example.org")
    assert not released or f"\n## [{springfoot.__version__}] - 20" in (ROOT / "CHANGELOG.md").read_text()


def links_of(page):
    return re.findall(r"\]\(([^)]*)\)", page)


def test_the_index_page_has_no_link_into_a_folder(metadata):
    source = PROJECT["project"].get("urls", {}).get("Source")
    assert metadata.get_payload() == setup.index_page(source, springfoot.__version__)
    assert metadata["Description-Content-Type"] == "text/markdown"
    assert all(link.startswith("https://") for link in links_of(metadata.get_payload()))


@pytest.mark.parametrize(("version", "commit"), [("0.1.0", "v0.1.0"), ("0.2.0.dev0", "HEAD")])
def test_links_of_the_index_page_lead_to_the_files_of_their_version(version, commit):
    page = setup.index_page("https://example.org/springfoot", version)
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    back = re.sub(rf"https://example\.org/springfoot/(?:raw|blob)/{commit}/", "", page)
    assert 'pip install "springfoot[train,live]"' in page and "pip install -e" not in page
    assert "clone" not in page.partition("## Four doors")[0] and len(links_of(page)) == len(links_of(readme)) > 10
    back = back.replace('"springfoot[train', '-e ".[train').replace(
        "Python 3.11 or newer:", "Python 3.11 or newer, in a clone:"
    )
    assert back == readme
    assert f"](https://example.org/springfoot/blob/{commit}/docs/explanation/design.md" in page
    assert (
        f"![A walk, ground forces as arrows, stiffness as colour](https://example.org/springfoot/raw/{commit}/" in page
    )
    assert (ROOT / "docs" / "walk.gif").is_file()


def test_each_package_of_a_users_extra_is_known_by_its_import():
    imports = {
        "pillow": "PIL",
        "stable-baselines3": "stable_baselines3",
        "axe-playwright-python": "axe_playwright_python",
        "imageio-ffmpeg": "imageio_ffmpeg",
    }
    extras = PROJECT["project"]["optional-dependencies"]
    users = {extra: map(Requirement, extras[extra]) for extra in set(extras) - {"bench", "dev", "docs", "gpu", "mjx"}}
    brought = {
        imports.get(one.name, one.name): extra
        for extra, lines in users.items()
        for one in lines
        if one.name != "springfoot"
    }
    assert brought == EXTRA_OF


STRICT = """
import springfoot
from springfoot.envs import SegmentedFootBiped, SegmentedFootBipedVector
from springfoot.gait import Body, plan_walk

env = SegmentedFootBiped(speed=1.2, push_newton=100.0)
observation, info = env.reset(seed=0)
observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
falls: bool = terminated
envs = SegmentedFootBipedVector(num_envs=4, num_threads=2)
observations, infos = envs.reset(seed=0)
observations, rewards, terminations, truncations, infos = envs.step(envs.action_space.sample())
knee: float = plan_walk(Body(height=1.80, mass=75), speed=1.3).joint_angles(0.6)["knee"].item()
print(springfoot.__version__, observation, info, observations, rewards, falls, knee)
"""


@pytest.fixture(scope="module")
def users_python(wheel, tmp_path_factory):
    """A Python that has the wheel and, besides ourselves, what is installed here."""
    folder = tmp_path_factory.mktemp("venv")
    venv.create(folder, with_pip=False)
    python = folder / "bin" / "python"
    code = "import sysconfig; print(sysconfig.get_path('purelib'))"
    packages = Path(subprocess.run([python, "-c", code], check=True, capture_output=True, text=True).stdout.strip())
    zipfile.ZipFile(wheel).extractall(packages)
    (packages / "others.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return python


@pytest.fixture(scope="module")
def verdicts(users_python, tmp_path_factory):
    """What pyright says of users' files, by their names: each message as one line. One process checks them all."""
    public = [room for room in ROOMS if room not in ("files", "cli", "examples")]
    names = {room: import_module(f"springfoot.{room}").__all__ for room in public}
    imports = [f"from springfoot.{room} import {', '.join(public)}" for room, public in names.items()]
    uses = [f"print({name})" for public in names.values() for name in public]
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    programs = {
        "every_name.py": ("strict", "\n".join([*imports, *uses]) + "\n"),
        "user.py": ("strict", STRICT),
        "mistaken.py": ("strict", STRICT.replace("height=1.80", 'height="tall"')),
        "readme.py": ("standard", "\n".join(blocks)),
    }
    folder = tmp_path_factory.mktemp("users")
    for name, (mode, code) in programs.items():
        (folder / name).write_text(f"# pyright: {mode}\n{code}", encoding="utf-8")
    (folder / "pyrightconfig.json").write_text("{}")
    command = [sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", str(users_python), *programs]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    report = json.loads(done.stdout)
    assert report["summary"]["filesAnalyzed"] == len(programs)
    said: dict[str, list[str]] = {name: [] for name in programs}
    for one in report["generalDiagnostics"]:
        said[Path(one["file"]).name].append(f"{one['range']['start']['line']}: {one['message']}")
    return said


@pytest.mark.slow
@pytest.mark.parametrize("program", ["every_name.py", "user.py"])
def test_no_public_name_is_unknown_to_a_strict_type_checker(verdicts, program):
    assert verdicts[program] == []


def test_the_readmes_python_passes_a_type_checker(verdicts):
    assert [line for line in verdicts["readme.py"] if "Expression value is unused" not in line] == []


def test_a_type_checker_finds_a_users_mistake(verdicts):
    assert any('"height"' in line for line in verdicts["mistaken.py"])


@pytest.fixture(scope="module")
def pins():
    """Name -> version of `constraints.txt`."""
    lines = re.findall(r"^([\w.-]+)==([\w.]+)", (ROOT / "constraints.txt").read_text(), re.MULTILINE)
    found = {canonicalize_name(name): pin for name, pin in lines}
    assert len(found) == len(lines)
    return found


def test_the_lock_has_the_pinned_version_and_the_hashes_of_all_but_torch(pins):
    text = (ROOT / "requirements.lock").read_text()
    entry = r"^([\w.-]+)==([\w.]+)(?: ; (.+))? \\\n((?:    --hash=sha256:[0-9a-f]{64}(?: \\)?\n)+)"
    entries = re.findall(entry, text, re.MULTILINE)
    assert re.sub(entry, "", text, flags=re.MULTILINE).count("\n") == 2  # the command that made it
    versions = {canonicalize_name(name): version for name, version, system, _ in entries if "win32" not in system}
    assert versions == {name: pins[name] for name in versions}
    extras = PROJECT["project"]["optional-dependencies"]
    lines = [*PROJECT["project"]["dependencies"], *(line for extra in EXTRAS for line in extras[extra])]
    names = {canonicalize_name(Requirement(line).name) for line in lines}
    assert names - versions.keys() == {"torch", "springfoot"}


def test_the_citation_names_the_pinned_versions(pins):
    software = re.findall(r"type: software\n    title: (.+)\n    version: (.+)\n", (ROOT / "CITATION.cff").read_text())
    assert {title.lower(): number for title, number in software} == {
        name: pins[name] for name in ("mujoco", "gymnasium", "stable-baselines3")
    }


def test_the_backend_that_builds_is_the_pinned_one(pins):
    assert PROJECT["build-system"]["requires"] == [f"setuptools=={pins['setuptools']}"]


def test_constraints_pin_every_requirement_inside_its_range(pins):
    extras = PROJECT["project"]["optional-dependencies"].values()
    for line in [*PROJECT["project"]["dependencies"], *(line for extra in extras for line in extra)]:
        requirement = Requirement(line)
        if requirement.name == PROJECT["project"]["name"]:  # an extra that includes another
            assert requirement.extras <= set(PROJECT["project"]["optional-dependencies"])
            continue
        assert pins[canonicalize_name(requirement.name)] in requirement.specifier, line


def test_commit_hooks_run_the_pinned_ruff():
    hooks = (ROOT / ".pre-commit-config.yaml").read_text()
    (revision,) = re.findall(r"ruff-pre-commit\n +rev: v(\S+)", hooks)
    assert f"\nruff=={revision} " in (ROOT / "constraints.txt").read_text()


@pytest.mark.parametrize(
    ("room", "absent"),
    [
        ("gait", {"matplotlib", "mujoco", "stable_baselines3", "torch"}),
        ("envs", {"matplotlib", "stable_baselines3", "torch", "tyro"}),
    ],
)
def test_a_room_works_without_the_floors_above(room, absent):
    modules = [
        ".".join(["springfoot", *path.with_suffix("").parts]).removesuffix(".__init__")
        for path in files(room)
        if path.suffix == ".py"
    ]
    code = "; ".join(f"import {module}" for module in modules)
    loaded = run(f"import sys; {code}; print(*{{name.partition('.')[0] for name in sys.modules}})").split()
    assert {"springfoot", "numpy"} <= set(loaded)
    assert not absent & set(loaded)


@pytest.mark.slow
def test_evaluating_and_the_studies_that_train_nothing_need_no_learner():
    names = ("compare", "bodies", "agreement", "any-stiffness")
    code = f"""
import sys
from springfoot.cli.main import main, study_class
assert main(["--help"]) == main(["study", "--help"]) == 0
assert not {{"scipy", "mujoco", "tyro"}} & set(sys.modules)
for name in {(*names, "learning-curves")}:
    study_class(name)
try:
    main(["evaluate", "--help"])
except SystemExit:
    print(*sys.modules)
"""
    loaded = run(code).splitlines()[-1].split()
    extra = {Requirement(line).name for line in PROJECT["project"]["optional-dependencies"]["train"]}
    learner = {"stable_baselines3", *(extra - {"springfoot", "stable-baselines3"})}
    assert "springfoot.cli.evaluate" in loaded
    assert not learner & set(loaded)


def test_no_file_names_a_place_on_somebodys_machine(known):
    place = re.compile(rb"(?<![\w./])/(?:home|root|work|tmp|Users|opt|mnt)/\w|[A-Z]:\\\\?Users")
    assert not [name for name in known if place.search((ROOT / name).read_bytes())]
