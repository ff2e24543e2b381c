"""Policies from elsewhere: any ONNX file and any function are walked, and one line says what is wrong with others."""

import json
import subprocess
import sys
from resource import RUSAGE_SELF, getrusage

import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper, save_model

from springfoot.agents import ForeignPolicy, load_policy
from springfoot.agents.policies import onnx_process
from springfoot.cli.evaluate import evaluate_main
from springfoot.envs.settings.settings import BipedSettings
from springfoot.envs.task.observation import OBSERVATION
from springfoot.errors import SpringfootError
from springfoot.evaluation import policy_and_settings, record
from springfoot.evaluation.recording.policies import policy_label

D = len(OBSERVATION)
WEIGHT = np.random.default_rng(0).normal(0, 0.3, (D, 4))
ROWS = np.random.default_rng(1).normal(size=(7, D)).astype(np.float32)
EXPECTED = (ROWS @ WEIGHT).clip(-1, 1)


def save_linear(
    path, shape=("N", D), weight=WEIGHT, kind=TensorProto.FLOAT, inputs=("observation",), outputs=("action",)
):
    """An ONNX file whose outputs are all the observation times `weight`."""
    dtype = helper.tensor_dtype_to_np_dtype(kind)
    nodes = [helper.make_node("MatMul", [inputs[0], "weight"], [name]) for name in outputs]
    given = [helper.make_tensor_value_info(name, kind, shape) for name in inputs]
    made = [helper.make_tensor_value_info(name, kind, [*shape[:-1], weight.shape[1]]) for name in outputs]
    graph = helper.make_graph(nodes, "linear", given, made, [numpy_helper.from_array(weight.astype(dtype), "weight")])
    save_model(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), path)
    return path


@pytest.mark.slow
@pytest.mark.parametrize("kind", [TensorProto.FLOAT, TensorProto.DOUBLE])
@pytest.mark.parametrize("shape", [("N", D), ("N", "D"), (1, D), (D,)])
def test_an_onnx_file_of_any_batch_is_a_policy(shape, kind, tmp_path):
    policy = load_policy(save_linear(tmp_path / "mine.onnx", shape, kind=kind))
    assert isinstance(policy, ForeignPolicy) and policy.settings == BipedSettings()
    assert policy(ROWS) == pytest.approx(EXPECTED, abs=1e-5) and policy(ROWS).dtype == np.float32
    assert policy(ROWS[3]) == pytest.approx(EXPECTED[3], abs=1e-5) and policy(ROWS[3]).shape == (4,)


def test_its_action_is_the_output_of_that_name_else_the_first(tmp_path):
    named = load_policy(save_linear(tmp_path / "named.onnx", outputs=("value", "action")))
    first = load_policy(save_linear(tmp_path / "first.onnx", outputs=("mean", "std")))
    assert np.array_equal(named(ROWS), first(ROWS))


def test_a_contract_beside_the_file_brings_its_settings(tmp_path):
    path = save_linear(tmp_path / "mine.onnx")
    (tmp_path / "mine.onnx.json").write_text(json.dumps({"settings": {"action_mode": "residual", "speed": 1.0}}))
    assert load_policy(path).settings == BipedSettings(action_mode="residual", speed=1.0)
    _, settings = policy_and_settings(str(path), {"push_newton": 100.0})
    assert (settings.action_mode, settings.speed, settings.push_newton) == ("residual", 1.2, 100.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("contract", "said"),
    [
        ("{", "is not a contract: JSONDecodeError: "),
        ("[]", "is not a contract: TypeError: "),
        ("{}", "has no 'settings'"),
        ('{"settings": {"mass": -1}}', "is not a contract: mass must be"),
        ('{"settings": {}, "fingerprint": {}}', None),
    ],
)
def test_a_contract_that_is_wrong_is_refused_with_one_line(contract, said, tmp_path):
    path = save_linear(tmp_path / "mine.onnx")
    (tmp_path / "mine.onnx.json").write_text(contract)
    with pytest.raises(SpringfootError) as refused:
        load_policy(path)
    whole = f"{path}.json {said}"
    other = (
        f"{path} was trained on another version of this environment: other observation and action and model and legs"
    )
    assert str(refused.value).startswith(whole if said else other) and "\n" not in str(refused.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"shape": ("N", 24), "weight": WEIGHT[:24]}, f": its input must be (N, {D}), is (N, 24)"),
        ({"shape": ("N", 2, D)}, f": its input must be (N, {D}), is (N, 2, {D})"),
        ({"shape": (8, D)}, f" fails on observations (2, {D}): "),
        ({"weight": WEIGHT[:, :3]}, f" must return actions (2, 4) for observations (2, {D}), returned (2, 3)"),
        ({"weight": WEIGHT * np.nan}, " returned an action that is not finite"),
        ({"kind": TensorProto.FLOAT16}, ": its input must be of float32 or float64, is tensor(float16)"),
        (
            {"inputs": ("observation", "state")},
            " has the inputs observation, state; a policy has one, the observation",
        ),
    ],
)
def test_an_onnx_file_that_is_no_policy_is_refused_with_one_line(how, said, tmp_path):
    path = save_linear(tmp_path / "mine.onnx", **how)
    with pytest.raises(SpringfootError) as refused:
        load_policy(path)
    assert str(refused.value).startswith(f"{path}{said}") and "\n" not in str(refused.value)


def save_nodes(path, nodes):
    """An ONNX file of `nodes`, which make the (N, 4) `action` of the `observation`."""
    given = [helper.make_tensor_value_info("observation", TensorProto.FLOAT, ("N", D))]
    made = [helper.make_tensor_value_info("action", TensorProto.FLOAT, ("N", 4))]
    graph = helper.make_graph(nodes, "nodes", given, made)
    save_model(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), path)
    return path


def constant(name, values, kind=TensorProto.INT64):
    return helper.make_node("Constant", [], [name], value=helper.make_tensor(name, kind, [len(values)], values))


def test_an_onnx_file_that_would_fill_the_memory_is_one_line(tmp_path):
    nodes = [constant("shape", [2**16, 2**15]), helper.make_node("ConstantOfShape", ["shape"], ["large"])]
    nodes += [helper.make_node("ReduceMax", ["large"], ["zero"], keepdims=0)]
    nodes += [constant("ends", [4]), constant("begin", [0]), constant("axis", [1])]
    nodes += [helper.make_node("Slice", ["observation", "begin", "ends", "axis"], ["four"])]
    nodes += [helper.make_node("Add", ["four", "zero"], ["action"])]
    path, before = save_nodes(tmp_path / "mine.onnx", nodes), getrusage(RUSAGE_SELF).ru_maxrss
    with pytest.raises(
        SpringfootError, match=r"mine\.onnx (is damaged|is not an ONNX file|fails on).*alloc"
    ) as refused:
        load_policy(path)
    assert "\n" not in str(refused.value) and getrusage(RUSAGE_SELF).ru_maxrss < before + 300 * 1024


def nodes_of_a_real_observation():
    """Nodes that make `count`, 0 for an observation of zeros and huge for a real one, and `action` from `zero`."""
    return [
        helper.make_node("Abs", ["observation"], ["size"]),
        helper.make_node("ReduceMax", ["size"], ["most"], keepdims=0),
        constant("huge", [1e12], TensorProto.FLOAT),
        helper.make_node("Mul", ["most", "huge"], ["scaled"]),
        constant("bound", [2e9], TensorProto.FLOAT),
        helper.make_node("Min", ["scaled", "bound"], ["bounded"]),
        helper.make_node("Cast", ["bounded"], ["count"], to=TensorProto.INT64),
        *(constant("ends", [4]), constant("begin", [0]), constant("axis", [1])),
        helper.make_node("Slice", ["observation", "begin", "ends", "axis"], ["four"]),
        helper.make_node("Add", ["four", "zero"], ["action"]),
    ]


def test_an_onnx_file_that_fills_the_memory_for_real_observations_alone_is_one_line(tmp_path):
    *nodes, add = nodes_of_a_real_observation()
    nodes += [helper.make_node("ConstantOfShape", ["count"], ["large"]), constant("one", [0.0], TensorProto.FLOAT)]
    nodes += [helper.make_node("Concat", ["large", "one"], ["some"], axis=0)]
    nodes += [helper.make_node("ReduceMax", ["some"], ["zero"], keepdims=0), add]
    path, before = save_nodes(tmp_path / "mine.onnx", nodes), getrusage(RUSAGE_SELF).ru_maxrss
    with pytest.raises(SpringfootError, match=r"mine\.onnx (is damaged|fails on)") as refused:
        load_policy(path)
    assert "\n" not in str(refused.value) and getrusage(RUSAGE_SELF).ru_maxrss < before + 300 * 1024


def test_an_onnx_file_that_fills_the_memory_for_one_row_alone_is_one_line(tmp_path):
    nodes = [helper.make_node("Shape", ["observation"], ["shape"]), constant("one", [1]), constant("first", [0])]
    nodes += [helper.make_node("Gather", ["shape", "first"], ["rows"]), constant("huge", [2 * 10**9])]
    nodes += [helper.make_node("Equal", ["rows", "one"], ["alone"])]
    nodes += [helper.make_node("Where", ["alone", "huge", "one"], ["count"])]
    nodes += [helper.make_node("ConstantOfShape", ["count"], ["large"])]
    nodes += [helper.make_node("ReduceMax", ["large"], ["zero"], keepdims=0)]
    nodes += [
        constant("ends", [3]),
        constant("begin", [0]),
        constant("axis", [1]),
    ]  # three actions: rows are tried next
    nodes += [helper.make_node("Slice", ["observation", "begin", "ends", "axis"], ["three"])]
    nodes += [helper.make_node("Add", ["three", "zero"], ["action"])]
    path, before = save_nodes(tmp_path / "mine.onnx", nodes), getrusage(RUSAGE_SELF).ru_maxrss
    with pytest.raises(SpringfootError, match=r"mine\.onnx (is damaged|fails on|must return)") as refused:
        load_policy(path)
    assert "\n" not in str(refused.value) and getrusage(RUSAGE_SELF).ru_maxrss < before + 300 * 1024


@pytest.mark.parametrize("operator", ["RandomNormal", "RandomUniform"])
def test_an_onnx_file_that_draws_random_numbers_is_one_line(tmp_path, operator):
    nodes = [helper.make_node(operator, [], ["zero"], shape=[1]), nodes_of_a_real_observation()[-1]]
    nodes[:0] = nodes_of_a_real_observation()[-5:-1]
    with pytest.raises(SpringfootError, match=rf"mine\.onnx .* the operator {operator} is not allowed in a policy$"):
        load_policy(save_nodes(tmp_path / "mine.onnx", nodes))


def test_an_onnx_file_that_loops_is_one_line(tmp_path):
    body = helper.make_graph(
        [
            helper.make_node("Identity", ["go"], ["on"]),
            helper.make_node("Add", ["sum", "sum"], ["more"]),
        ],
        "body",
        [
            helper.make_tensor_value_info("turn", TensorProto.INT64, []),
            helper.make_tensor_value_info("go", TensorProto.BOOL, [1]),
            helper.make_tensor_value_info("sum", TensorProto.FLOAT, [1]),
        ],
        [
            helper.make_tensor_value_info("on", TensorProto.BOOL, [1]),
            helper.make_tensor_value_info("more", TensorProto.FLOAT, [1]),
        ],
    )
    *nodes, add = nodes_of_a_real_observation()
    nodes += [constant("start", [0.0], TensorProto.FLOAT), constant("true", [True], TensorProto.BOOL)]
    nodes += [helper.make_node("Loop", ["count", "true", "start"], ["zero"], body=body), add]
    with pytest.raises(SpringfootError, match=r"mine\.onnx .* the operator Loop is not allowed in a policy$"):
        load_policy(save_nodes(tmp_path / "mine.onnx", nodes))


def test_an_onnx_file_that_is_too_large_or_crashes_the_library_is_one_line(tmp_path, monkeypatch):
    path = tmp_path / "mine.onnx"
    with path.open("wb") as file:
        file.truncate(2**26 + 1)  # sparse
    with pytest.raises(SpringfootError, match=r"mine\.onnx must have at most 67,108,864 bytes, has 67,108,865"):
        load_policy(path)
    monkeypatch.setattr(onnx_process, "_CHILD", "import os; os.abort()")
    with pytest.raises(SpringfootError, match="is damaged: onnxruntime crashed on it, or took over 60 s or 512 MiB"):
        load_policy(save_linear(path))


@pytest.mark.slow
@pytest.mark.parametrize("content", [b"", b"import springfoot\n" * 20, b"\x80\x04K\x01."])
def test_what_is_no_onnx_file_is_refused_with_one_line(content, tmp_path):
    path = tmp_path / "mine.onnx"
    path.write_bytes(content)
    with pytest.raises(SpringfootError) as refused:
        load_policy(path)
    assert str(refused.value).startswith(f"{path} is not an ONNX file that onnxruntime runs: ")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("package", ["onnx", "onnxruntime"])
def test_without_its_packages_the_line_says_what_to_install(package, tmp_path, monkeypatch):
    path = save_linear(tmp_path / "mine.onnx")
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(SpringfootError) as refused:
        load_policy(path)
    assert str(refused.value) == f"{path} needs the package {package}: pip install 'springfoot[onnx]'"


FUNCTIONS = """
import numpy as np
import springfoot.agents

WEIGHT = np.random.default_rng(0).normal(0, 0.3, (43, 4))

def batch(observation):
    return observation @ WEIGHT

def alone(observation):
    return [float(observation @ column) for column in WEIGHT.T]

def one_row(observation):
    (row,) = observation
    return (row @ WEIGHT)[None]

def residual(observation):
    return observation @ WEIGHT

residual.settings = {"action_mode": "residual"}

class Network:
    def __call__(self, observation):
        return observation @ WEIGHT

network = Network()
ours = springfoot.agents.policy_from_mlp([(WEIGHT.T, None)], {"speed": 1.1}, activation="tanh")

def fails(observation):
    return observation[1000]

def three(observation):
    return np.zeros((len(observation), 3))

def nan(observation):
    return np.full((len(observation), 4), np.nan)

def light(observation):
    return np.zeros((len(observation), 4))

light.settings = {"mass": -1.0}
number = 3


def quits(observation):
    raise SystemExit(0)


def quits_later(observation):
    quits_later.calls += 1
    if quits_later.calls > 4:
        raise SystemExit(0)
    return np.zeros((len(observation), 4))

quits_later.calls = 0


class Quitting:
    def __call__(self, observation):
        return np.zeros((len(observation), 4))

    @property
    def settings(self):
        raise SystemExit(0)

quitting = Quitting()


def __getattr__(name):
    if name == "absent":
        raise SystemExit(0)
    raise AttributeError(name)


def generator_exit(observation):
    raise GeneratorExit




def turned(observation):
    return np.full((len(observation), 4), 0.5j)

def dates(observation):
    return np.zeros((len(observation), 4), "datetime64[s]")

def words(observation):
    return np.full((len(observation), 4), "0.5")
"""


@pytest.fixture(scope="module")
def module(tmp_path_factory):
    """A folder with a module of functions, where the user is."""
    folder = tmp_path_factory.mktemp("mine")
    (folder / "my_policies.py").write_text(FUNCTIONS.replace("43", str(D)))
    (folder / "broken_policies.py").write_text("raise RuntimeError('not\\ntoday')")
    (folder / "quitting_policies.py").write_text("raise SystemExit(0)")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(sys, "path", [*sys.path])
        yield folder


@pytest.mark.parametrize("name", ["batch", "alone", "one_row", "residual", "network", "ours"])
def test_a_function_of_a_module_is_a_policy(name, module):
    policy = load_policy(f"my_policies:{name}")
    assert policy(ROWS) == pytest.approx(EXPECTED, abs=1e-5)
    assert policy(ROWS[3]) == pytest.approx(EXPECTED[3], abs=1e-5) and policy(ROWS[3]).shape == (4,)
    own = {"residual": BipedSettings(action_mode="residual"), "ours": BipedSettings(speed=1.1)}
    assert policy.settings == own.get(name, BipedSettings())


@pytest.mark.parametrize(
    ("name", "said"),
    [
        (
            "nobody_is_here:act",
            "nobody_is_here:act: cannot import nobody_is_here: ModuleNotFoundError: No module named",
        ),
        ("broken_policies:act", "broken_policies:act: cannot import broken_policies: RuntimeError: not today"),
        ("my_policies:nothing", "my_policies:nothing: module my_policies has no function nothing ("),
        ("my_policies:number", "my_policies:number: module my_policies has no function number ("),
        ("my_policies:fails", f"my_policies:fails fails on observations (2, {D}): IndexError: index 1000 is out of"),
        (
            "my_policies:three",
            f"my_policies:three must return actions (2, 4) for observations (2, {D}), returned (2, 3)",
        ),
        ("my_policies:nan", "my_policies:nan returned an action that is not finite"),
        ("my_policies:light", "my_policies:light: its settings: mass must be"),
        ("my_policies:quits", "my_policies:quits calls sys.exit(0): a policy must return actions"),
        ("my_policies:quitting", "my_policies:quitting calls sys.exit(0): a policy must return actions"),
        ("my_policies:absent", "my_policies:absent calls sys.exit(0): a policy must return actions"),
        ("my_policies:generator_exit", "my_policies:generator_exit raises GeneratorExit: a policy must return actions"),
        ("quitting_policies:act", "quitting_policies:act calls sys.exit(0): a policy must return actions"),
        ("my_policies:turned", "my_policies:turned must return real actions, returned complex ones"),
        (
            "my_policies:dates",
            "my_policies:dates must return actions (2, 4), returned no numbers",
        ),
        (
            "my_policies:words",
            "my_policies:words must return actions (2, 4), returned no numbers",
        ),
    ],
)
def test_a_function_that_is_no_policy_is_refused_with_one_line(name, said, module):
    with pytest.raises(SpringfootError) as refused:
        load_policy(name)
    assert str(refused.value).startswith(said) and "\n" not in str(refused.value)


def test_a_function_that_ends_python_ends_an_evaluation_in_one_line(module, tmp_path, capsys):
    assert evaluate_main(["my_policies:quits_later", "--episodes", "1", "--out", str(tmp_path / "out")]) == 2
    assert "my_policies:quits_later calls sys.exit(0): a policy must return actions" in capsys.readouterr().err


@pytest.mark.slow
def test_evaluate_walks_an_onnx_file_and_a_function(module, tmp_path, capsys):
    path = save_linear(tmp_path / "mine.onnx", weight=np.zeros((D, 4)))
    words = ["--episodes", "1", "--seconds", "1", "--out"]
    assert evaluate_main([str(path), *words, str(tmp_path / "one")]) == 0
    assert evaluate_main(["my_policies:batch", *words, str(tmp_path / "two")]) == 0
    capsys.readouterr()
    metrics = [json.loads((tmp_path / name / "metrics.json").read_text()) for name in ("one", "two")]
    assert [each["policy"] for each in metrics] == ["mine", "my_policies-batch"]
    untrained, settings = policy_and_settings("untrained", {"episode_seconds": 1.0})
    walked = record(*policy_and_settings(str(path), {"episode_seconds": 1.0}), name="mine", episodes=2, threads=1)
    assert np.array_equal(walked.returns, record(untrained, settings, name="untrained", episodes=2, threads=1).returns)


def test_results_are_called_as_the_policy_is():
    assert [policy_label(name) for name in ("runs/mine.onnx", "package.module:act")] == ["mine", "package.module-act"]


@pytest.mark.slow
def test_only_the_users_own_words_run_code(tmp_path):
    """A run folder of that name, a file in it and a contract are read and never imported."""
    code = "import pathlib; pathlib.Path('ran').touch()"
    (tmp_path / "evil.py").write_text(code)
    run = tmp_path / "evil:act"
    run.mkdir()
    save_linear(tmp_path / "mine.onnx")
    (tmp_path / "mine.onnx.json").write_text(json.dumps({"settings": {}, "policy": "evil:act"}))
    walk = "from springfoot.agents import load_policy; import pathlib; load_policy('mine.onnx')\n"
    for name in ("'evil:act'", "pathlib.Path('other:act')"):
        walk += f"try: load_policy({name})\nexcept ValueError as error: print(error)\n"
    done = subprocess.run([sys.executable, "-c", walk], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (
        done.stdout.splitlines()[0] == "evil:act is a folder without best.safetensors, so not a run of springfoot train"
    )
    assert done.stdout.splitlines()[1].startswith("no policy other:act: give ")
    assert not (tmp_path / "ran").exists()


def test_actions_that_change_their_shape_or_end_are_refused():
    answers = iter([np.zeros((1, 4)), np.zeros((1, 5)), np.full((1, 4), np.inf), np.full((1, 4), 7.0)])
    policy = ForeignPolicy(name="mine", settings=BipedSettings(), width=D, act=lambda rows: next(answers))
    assert np.array_equal(policy(ROWS[0]), np.zeros(4))
    with pytest.raises(SpringfootError, match=r"^mine must return actions \(1, 4\), returned \(1, 5\)$"):
        policy(ROWS[0])
    with pytest.raises(SpringfootError, match=r"^mine returned an action that is not finite$"):
        policy(ROWS[0])
    assert np.array_equal(policy(ROWS[0]), np.ones(4))
    with pytest.raises(SpringfootError, match=rf"^observations must be \(N, {D}\), got \(2, 3\)$"):
        policy(np.zeros((2, 3)))
    with pytest.raises(SpringfootError, match=r"^observations must be finite"):
        policy(ROWS * np.nan)
