"""Build the site: `make site`, into build/site/html. Every broken link is an error; no network is needed."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
DOCS, ROOT = HERE.parent, HERE.parent.parent
BUILD = ROOT / "build" / "site"
GROUP = re.compile(r"^\*\*(?P<title>[^*]+)\*\*(?P<links>.*\(.*\.md\).*)$", re.MULTILINE)
LINK = re.compile(r"\[([^\]]+)\]\(([\w/-]+\.md)\)")
TO_A_FILE = re.compile(r"(?<!!)\[([^\]]+)\]\(([^)#:\s]+)(?:#[^)\s]*)?\)")
OUTSIDE = re.compile(r"\[([^\]]+)\]\((\.\./(?!images)[^)]*|decisions/|notebooks/[^)]*)\)")


def _linked(text: str, folder: Path) -> str:
    """Return a page whose links to other pages of the site stay; of any other file only the text."""

    def kept(link: re.Match[str]) -> str:
        is_page = link[2].endswith(".md") and (folder / link[2]).is_file()
        return link[0] if is_page else link[1]

    return TO_A_FILE.sub(kept, text)


def build() -> int:
    """Write the pages into a folder and let Sphinx make the site; the exit code is Sphinx's."""
    sys.path.insert(0, str(HERE))
    from recording_page import page
    from reference import pages

    source = BUILD / "source"
    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(DOCS, source, ignore=shutil.ignore_patterns("site", "*.py", "*.ipynb"))
    shutil.copy(HERE / "conf.py", source / "conf.py")
    for path in source.rglob("*.md"):
        path.write_text(_linked(path.read_text(encoding="utf-8"), path.parent), encoding="utf-8")
    made = {**pages(), "ref_recording.md": page()}
    for name, text in made.items():
        (source / name).write_text(text, encoding="utf-8")
    (source / "index.md").write_text(_index((source / "README.md").read_text(encoding="utf-8"), made), encoding="utf-8")
    (source / "README.md").unlink()
    html = BUILD / "html"
    command = ["-m", "sphinx", "-W", "--keep-going", "-q", "-E", "-b", "html", str(source), str(html)]
    code = subprocess.run([sys.executable, *command], check=False).returncode
    if not code:
        sys.stdout.write(f"{html / 'index.html'}\n")
    return code


def _index(listed: str, made: dict[str, str]) -> str:
    """Return the first page: the README, and the pages by their groups."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8").replace("](docs/", "](")
    readme = re.sub(r"\]\(README\.md\)", "](genindex)", readme).split("## Reading on")[0]
    parts = [OUTSIDE.sub(r"\1", readme)]
    decisions = sorted(f"decisions/{path.name}" for path in (DOCS / "decisions").glob("*.md"))
    beside = {"Reference": list(made), "Contributing": decisions}
    for found in GROUP.finditer(listed):
        names = [name for _, name in LINK.findall(found["links"])]
        parts.append(_tree(found["title"], names + beside.pop(found["title"], [])))
    if beside:
        raise SystemExit(f"docs/README.md has no group {', '.join(beside)}")
    return "\n".join(parts)


def _tree(title: str, names: list[str]) -> str:
    return "\n".join(["```{toctree}", f":caption: {title}", ":maxdepth: 1", ":hidden:", "", *names, "```", ""])


if __name__ == "__main__":
    sys.exit(build())
