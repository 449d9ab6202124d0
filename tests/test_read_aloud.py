"""Docstrings as an engineer reads them: a verb or a noun first, and a first line that stands alone."""

import ast
import re
from collections.abc import Iterator

from tests.architecture_picture import PACKAGE, statements

LONGEST = 88
# Words that begin a riddle: a question, a place, a condition or a pronoun in place of the thing.
NOT_FIRST = re.compile(
    r"(What|Whether|How|Of|Where|When|Why|Which|Who|Whose|If|As|In|On|At|By|For|From|To|With|Without|That|This|These|"
    r"Those|It|Its|Their|There|Here|So|And|Or|But|Not|Nothing|Only|Also|Same|Then|Than|Until|Unless|While|Is|Are|Has|"
    r"Have|Does|Do|May|Must|Can|None|Behind|Before|After|Between|Beside|Because|Else|Like|They|We|You|He|Under|Over|"
    r"Above|Below|Into|Out|Up|Once)\b"
)


def test_a_docstring_begins_with_a_verb_or_a_noun_on_a_line_of_its_own() -> None:
    broken = []
    for path in sorted(PACKAGE.rglob("*.py")):
        for line, doc in _docstrings(ast.parse(path.read_text(encoding="utf-8"))):
            head = doc.split("\n")[0]
            if len(head) > LONGEST or not head.strip() or NOT_FIRST.match(head):
                broken.append(f"{path}:{line}: {head}")
    assert not broken, "\n".join(broken)


def _docstrings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    for node in statements(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            doc = ast.get_docstring(node)
            if doc is not None:
                yield getattr(node, "lineno", 1), doc
