"""Define the command that writes a policy for use without springfoot: `springfoot export`."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from springfoot.command_line import end_in_order, exit_code, parse
from springfoot.errors import SpringfootError


@dataclass(frozen=True, kw_only=True)
class ExportFlags:
    """Write a policy as an ONNX file that runs without springfoot: raw observation in, action and stiffness out.

    Beside FILE appears its contract, FILE.json: names, units, order and bounds of inputs and outputs.
    """

    policy: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="POLICY")]
    """A .safetensors file, a run folder (its best policy), or pretrained."""
    out: Annotated[Path, tyro.conf.arg(metavar="FILE", help_behavior_hint="")]
    """New file, which ends in .onnx; any ONNX runtime reads it."""


def export_main(arguments: Sequence[str] | None = None, program: str = "springfoot export") -> int:
    """Run the command line; return its exit code: 0 written, 2 bad input, 130 ended by Ctrl-C.

    `arguments` are those of the process unless given; `program` is the name in messages.
    """
    flags = parse(ExportFlags, arguments, program)
    return exit_code(program, lambda: run_export(flags))


def run_export(flags: ExportFlags) -> None:
    """Export the policy, and print the names of the new files."""
    from springfoot.agents.policies.baselines import has_feedback
    from springfoot.agents.policies.export import export_policy, planned_files
    from springfoot.agents.policies.foreign import is_function
    from springfoot.agents.policies.policy import read_policy

    end_in_order()
    planned_files(flags.out)  # raises before the policy is read
    if not has_feedback(flags.policy) or flags.policy.endswith(".onnx") or is_function(flags.policy):
        raise SpringfootError(
            f"{flags.policy} has no weights to export: give a .safetensors file, a run folder or pretrained"
        )
    files = export_policy(read_policy(flags.policy), flags.out)
    print(f"Results: {', '.join(map(str, files))}")
    print(f"Next:    springfoot evaluate {shlex.quote(str(flags.out))}")
