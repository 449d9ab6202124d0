"""What of a text a Markdown parser takes for markup that nobody but us may write."""

from markdown_it import MarkdownIt

MARKDOWN = MarkdownIt("commonmark").enable("table")
_FOREIGN = {"link_open", "image", "html_inline", "html_block", "code_inline", "code_block", "fence", "hr"}


def foreign_markup(text: str) -> set[str]:
    """Links, pictures, HTML, code and rules in a text; the program itself writes none of these."""
    tokens = MARKDOWN.parse(text)
    return {part.type for token in tokens for part in (token, *(token.children or ()))} & _FOREIGN
