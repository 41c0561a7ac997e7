"""Words that a shell completes: names of studies, scenes and organs, without loading the command that takes them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from studies.cli import outline

KIND = {
    "list": "kinds",
    "run": "studies",
    "status": "studies",
    "table": "studies",
    "plot": "studies",
    "publish": "studies",
    "archive": "studies",
    "advise": "scenes",
    "cost": "scenes",
    "safe-dt": "scenes",
    "view": "scenes",
    "export": "scenes",
    "judge": "scenes",
    "calibrate": "organs",
    "mesh": "organs",
}
"""Command -> what its arguments name; the shell completes file names where nothing is listed, or nothing fits."""


def scenes() -> list[str]:
    """Names of the scenes."""
    from studies.scenes import SCENES

    return [scene.name for scene in SCENES]


def organs() -> list[str]:
    """Names of the organs."""
    from studies.geometry.organs import SHAPES

    return list(SHAPES)


NAMES: dict[str, Callable[[], list[str]]] = {
    "kinds": lambda: ["studies", "scenes", "organs", "methods", "metrics"],
    "studies": lambda: [name for name, _ in outline.studies()],
    "scenes": scenes,
    "organs": organs,
}


@dataclass(frozen=True)
class Behind:
    """A command that is loaded only where its options are asked for."""

    name: str
    load: Callable[[], Any]

    def options(self, ctx: Any, incomplete: str) -> list[Any]:
        """Options that begin as `incomplete` does."""
        command, own = self._with_context(ctx)
        return command.shell_complete(own, incomplete)

    def words(self, ctx: typer.Context, incomplete: str) -> list[str]:
        """Names that begin as `incomplete` does and are not there yet; the values of an option that waits for one."""
        given = _given(ctx)
        if given and given[-1].startswith("-"):
            values = self._values(ctx, given[-1], incomplete)
            if values is not None:
                return values
        names = NAMES[KIND[self.name]]() if self.name in KIND else []
        return [name for name in names if name.startswith(incomplete) and name not in given]

    def _values(self, ctx: Any, option: str, incomplete: str) -> list[str] | None:
        command, own = self._with_context(ctx)
        for one in command.get_params(own):
            if option in one.opts and not one.is_flag:
                return [item.value for item in one.shell_complete(own, incomplete)]
        return None  # it is a flag, or none of the command's

    def _with_context(self, ctx: Any) -> tuple[Any, Any]:
        command = self.load()
        return command, command.make_context(self.name, _given(ctx), parent=ctx.parent, resilient_parsing=True)


def _given(ctx: Any) -> list[str]:
    return list(ctx.params.get("words") or ())


def unloaded(name: str, load: Callable[[], Any]) -> Any:
    """A command as a shell completes it; `load` gives the command itself."""
    behind = Behind(name, load)

    class Unloaded(TyperCommand):
        def shell_complete(self, ctx: Any, incomplete: str) -> list[Any]:
            return behind.options(ctx, incomplete)

    def command(words: Annotated[list[str] | None, typer.Argument(autocompletion=behind.words)] = None) -> None: ...

    alone = typer.Typer(add_completion=False)
    alone.command(name, cls=Unloaded, context_settings={"ignore_unknown_options": True})(command)
    return typer.main.get_command(alone)
