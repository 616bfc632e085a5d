"""Options that belong together, as one parameter of a command."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar, get_type_hints

Result = TypeVar("Result")


def with_option_groups(command: Callable[..., Result]) -> Callable[..., Result]:
    """Give a command an option for each field of the dataclasses among its parameters.

    The fields are annotated as the options of a command are. A parameter's default value, where it has one, gives the
    options other defaults than the fields'.

    Examples
    --------
    >>> @dataclass(frozen=True, kw_only=True)
    ... class Pose:
    ...     q1_deg: Annotated[float, typer.Option(help="Pan joint angle, in degrees.")] = 0.0
    >>> def gaze(rig: RigArgument, pose: Pose) -> None: ...  # mirrorgaze gaze RIG --q1-deg 30
    """
    signature = inspect.signature(command, eval_str=True)
    groups = {name: each for name, each in signature.parameters.items() if dataclasses.is_dataclass(each.annotation)}
    if not groups:
        return command
    parameters = [
        option.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        for name, parameter in signature.parameters.items()
        for option in (_options(parameter) if name in groups else [parameter])
    ]

    @wraps(command)
    def grouped(**given: Any) -> Result:
        for name, parameter in groups.items():
            values = {field.name: given.pop(field.name) for field in dataclasses.fields(parameter.annotation)}
            given[name] = parameter.annotation(**values)
        return command(**given)

    # What typer reads a command by.
    grouped.__dict__["__signature__"] = signature.replace(parameters=parameters)
    grouped.__annotations__ = {each.name: each.annotation for each in parameters}
    return grouped


def _options(group: inspect.Parameter) -> list[inspect.Parameter]:
    hints = get_type_hints(group.annotation, include_extras=True)
    defaults = group.annotation() if group.default is inspect.Parameter.empty else group.default
    return [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=getattr(defaults, name), annotation=hint)
        for name, hint in hints.items()
    ]
