"""Import the public names of a package from its modules at their first use."""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

from .extras import naming_extras


def lazy_names(package: str, modules: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the `__getattr__` of a package with public names that come from its modules.

    Args:
        package: the package's `__name__`.
        modules: public name -> module inside the package, dotted.
    """

    def find(name: str) -> Any:
        """Return the public `name` from its module, which is imported now."""
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        with naming_extras():
            return getattr(import_module(f"{package}.{modules[name]}"), name)

    return find
