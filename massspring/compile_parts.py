"""How functions are compiled: once for callers in Python, and inlined into each compiled caller.

numba makes machine code of every function and again of each caller that inlines it; that took half of the compile time.
Here a function that compiled code calls gets machine code only as part of its callers. If Python calls it too, it is
compiled once more, for Python. It is not compiled again for each constant argument.
"""

from collections.abc import Callable
from types import FunctionType
from typing import Any, TypeVar

import llvmlite.binding as llvm
import numba
from numba import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import AnalysisPass, register_pass
from numba.core.typed_passes import IRLegalization

from massspring.compile_cache import kept

Function = TypeVar("Function", bound=Callable[..., Any])


def kept_function(function: Function, **options: Any) -> Function:
    """The function, compiled on first call and cached on disk, with numba's `options`; unchanged if numba is
    disabled."""
    twin = FunctionType(
        function.__code__, function.__globals__, function.__name__, function.__defaults__, function.__closure__
    )
    twin.__qualname__, twin.__module__ = f"{function.__qualname__}.part", function.__module__
    options = {"cache": True, "no_cfunc_wrapper": True, **options}
    with kept():
        whole: Any = numba.njit(**options)(function)
        part: Any = numba.njit(**options | {"no_cpython_wrapper": True, "pipeline_class": PartCompiler})(twin)
    if whole is not function:
        whole.get_overload = part.get_overload
        whole.get_call_template = lambda args, named: part.get_call_template(
            [types.unliteral(arg) for arg in args], {name: types.unliteral(arg) for name, arg in named.items()}
        )
    return whole


class Part(JITCodeLibrary):
    """A code library that only callers link. It makes no machine code except for numba's environment variables."""

    def _optimize_final_module(self) -> None:
        """Nothing: callers optimise the code that they link."""

    def _finalize_final_module(self) -> None:
        whole, self._finalized = self._final_module, True
        self._shared_module, self._finalized = self._get_module_for_linking(), False
        names = [one.name for one in whole.global_variables if one.name.startswith("_ZN08NumbaEnv")]
        left = "".join(f'@"{name}" = common global ptr null\n' for name in names)
        self._final_module = llvm.parse_assembly(f'target triple = "{whole.triple}"\n{left}')
        super()._finalize_final_module()


@register_pass(mutates_CFG=False, analysis_only=True)
class _IntoPart(AnalysisPass):
    _name = "into_part"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        """Sets the code library of the function before numba would create one."""
        state.library = Part(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return False


class PartCompiler(CompilerBase):
    """numba's compiler with `Part` as code library."""

    def define_pipelines(self) -> list[Any]:
        """numba's default passes and `_IntoPart`."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_IntoPart, IRLegalization)
        passes.finalize()
        return [passes]
