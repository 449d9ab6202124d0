"""Metadata of rosbag2 about a bag: its files, and the number of messages of each topic.

It stands in metadata.yaml and in the database. It is read by its indents, as rosbag2 and its peers lay it out; nothing
else of YAML is understood.
"""

import re
from dataclasses import field

from groundstation.base.dataclasses import dataclass

_FILES = re.compile(r"^\s*relative_file_paths:\s*\n((?:\s*-\s*.+\n?)+)", re.MULTILINE)
_FILE = re.compile(r"^\s*-\s*(.+?)\s*$", re.MULTILINE)
_TOPICS = re.compile(r"^( *)topics_with_message_count:[ \t]*\n", re.MULTILINE)
_COUNT = re.compile(r"^[ -]*message_count:[ \t]*(\d{1,18})[ \t]*$", re.MULTILINE)
_NAME = re.compile(r"^ *name:[ \t]*(.+?)[ \t]*$", re.MULTILINE)


@dataclass(frozen=True)
class BagMetadata:
    """Files of a bag in their order, and messages of each topic.

    Examples
    --------
    >>> lines = "topics_with_message_count:", "  - topic_metadata:", "      name: /fix", "    message_count: 12", ""
    >>> BagMetadata.of("\\n".join(lines)).messages
    {'/fix': 12}
    """

    files: tuple[str, ...] = ()
    messages: dict[str, int] = field(default_factory=dict)

    @classmethod
    def of(cls, text: str) -> "BagMetadata":
        """Parse a text of metadata."""
        found = _FILES.search(text)
        names = _FILE.findall(found.group(1)) if found else []
        messages: dict[str, int] = {}
        for item in _items(text):
            name, count = _NAME.search(item), _COUNT.search(item)
            if name is not None and count is not None:
                topic = _plain(name.group(1))
                messages[topic] = messages.get(topic, 0) + int(count.group(1))
        return cls(tuple(_plain(name) for name in names), messages)


def _items(text: str) -> list[str]:
    """Split the list of topics into items, each as its lines."""
    head = _TOPICS.search(text)
    if head is None:
        return []
    items: list[str] = []
    indent = None
    for line in text[head.end() :].splitlines(keepends=True):
        depth = len(line) - len(line.lstrip(" "))
        is_item = line.lstrip(" ").startswith("- ")
        if line.strip() and (depth < len(head.group(1)) or (depth == len(head.group(1)) and not is_item)):
            break  # a key beside the list
        if is_item and (indent is None or depth == indent):
            indent = depth
            items.append("")
        if items:
            items[-1] += line
    return items


def _plain(text: str) -> str:
    return text[1:-1] if len(text) > 1 and text[0] == text[-1] and text[0] in "'\"" else text
