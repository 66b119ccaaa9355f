"""Options that several commands share, declared once: the fields of a dataclass."""

import dataclasses
import inspect
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any, get_args, get_origin, get_type_hints


class Without:
    """Fields of a bundle that are no options here and keep their defaults: ``Annotated[Bundle, Without("field")]``."""

    def __init__(self, *names: str) -> None:
        self.names = names


def bundled(command: Callable[..., None]) -> Callable[..., None]:
    """The command as the shell is to see it: a parameter whose type is a dataclass gives way to the fields of that.

    A field is declared like a parameter of a command, ``name: Annotated[type, typer.Option(...)] = default``.
    """
    hints = get_type_hints(command, include_extras=True)
    parameters: list[inspect.Parameter] = []
    bundles: dict[str, tuple[type[Any], list[str]]] = {}
    for name, parameter in inspect.signature(command).parameters.items():
        bundle, left_out = _bundle(hints[name])
        if bundle is None:
            parameters.append(parameter.replace(annotation=hints[name], kind=inspect.Parameter.KEYWORD_ONLY))
            continue
        types = get_type_hints(bundle, include_extras=True)
        fields = [field for field in dataclasses.fields(bundle) if field.name not in left_out]
        bundles[name] = bundle, [field.name for field in fields]
        for field in fields:
            default = inspect.Parameter.empty if field.default is dataclasses.MISSING else field.default
            kind = inspect.Parameter.KEYWORD_ONLY
            parameters.append(inspect.Parameter(field.name, kind, default=default, annotation=types[field.name]))

    @wraps(command)
    def run(**arguments: Any) -> None:
        bundle_values = {
            name: bundle(**{key: arguments.pop(key) for key in keys}) for name, (bundle, keys) in bundles.items()
        }
        command(**arguments, **bundle_values)

    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined] # what typer reads
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return run


def _bundle(hint: object) -> tuple[type[Any] | None, tuple[str, ...]]:
    """The dataclass that a parameter is, if it is one, and its fields that are left out."""
    kind, *extras = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    if not (isinstance(kind, type) and dataclasses.is_dataclass(kind)):
        return None, ()
    return kind, tuple(name for extra in extras if isinstance(extra, Without) for name in extra.names)
