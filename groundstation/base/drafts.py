"""Loops as numba writes them for LLVM, optimised as a whole.

numba optimises each function of a loop and makes machine code of it, then does so again as part of each function that
calls it. For a loop that is kept as one object file (``base.machine_code``) all of that but the last is thrown away.
Here the functions of a loop stay as they were written until the loop is asked for; then they are linked and optimised
together, by the same steps.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any


@contextmanager
def drafts() -> Iterator[None]:
    """While this is open, what numba compiles are drafts: others can call them, Python cannot."""
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.registry import cpu_target

    context = cpu_target.target_context
    with global_compiler_lock:
        ordinary = context._internal_codegen
        context._internal_codegen = _drafting()
        try:
            yield
        finally:
            context._internal_codegen = ordinary


@cache
def _drafting() -> Any:
    """What makes drafts, in the place of what numba makes its libraries of code with."""
    from llvmlite import binding
    from numba.core.cgutils import normalize_ir_text
    from numba.core.codegen import JITCodeLibrary, JITCPUCodegen

    class Draft(JITCodeLibrary):
        """Code of one function, and which others it calls."""

        def add_ir_module(self, ir_module: Any) -> None:
            self._final_module.link_in(binding.parse_assembly(normalize_ir_text(str(ir_module))))

        def finalize(self) -> None:
            self._finalized = True

        def get_pointer_to_function(self, _name: str) -> int:
            """There is no machine code of a draft."""
            return 0

        def _get_module_for_linking(self) -> Any:
            """What a library that is no draft links."""
            if self._shared_module is None:
                self._shared_module = self._linked("linkonce_odr")
            return self._shared_module

        def optimised(self, entry: str) -> Any:
            """Module of the function and of all that it calls, for calls of the function named alone."""
            self._final_module = self._linked("internal", but=entry)
            self._optimize_functions(self._final_module)  # run_forecast takes 1.2 times as long without
            for _ in range(2):  # once leaves run_filter and run_forecast 5 % slower than function by function
                self._optimize_final_module()
            return self._final_module

        def _linked(self, linkage: str, but: str = "") -> Any:
            module, seen, waiting = self._final_module.clone(), {self}, list(self._linking_libraries)
            while waiting:
                library = waiting.pop()
                if library not in seen:
                    seen.add(library)
                    is_draft = isinstance(library, Draft)
                    waiting += library._linking_libraries if is_draft else []
                    code = library._final_module if is_draft else library._get_module_for_linking()
                    module.link_in(code, preserve=True)
            for function in module.functions:
                if not function.is_declaration and function.name != but:
                    function.linkage = linkage
            return module

    class Drafting(JITCPUCodegen):
        _library_class = Draft

        def set_env(self, _env_name: str, _env: Any) -> None:
            """A draft has no place for Python objects, and loops that are kept ask for none."""

    return Drafting("groundstation.drafts")
