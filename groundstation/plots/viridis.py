"""Colour scale of cells: viridis, even to the eye, safe for colour-blind readers.

Source: S. van der Walt, N. Smith, viridis, 2015 (CC0), at sixteenths of its length.
"""

_TEXT = "".join(
    (
        "440154 48186a 472d7b 424086 3b528b 33638d 2c728e 26828e 21918c ",
        "1fa088 28ae80 3fbc73 5ec962 84d44b addc30 d8e219 fde725",
    )
)
_STEPS = [[int(text[at : at + 2], 16) for at in (0, 2, 4)] for text in _TEXT.split()]


def viridis(share: float) -> tuple[int, int, int]:
    """Return the colour at a share of the scale from 0 to 1: red, green, blue.

    Examples
    --------
    >>> viridis(0.0), viridis(0.5), viridis(1.0), viridis(7.0)
    ((68, 1, 84), (33, 145, 140), (253, 231, 37), (253, 231, 37))
    """
    place = min(max(share, 0.0), 1.0) * (len(_STEPS) - 1)
    low = min(int(place), len(_STEPS) - 2)
    red, green, blue = (
        round(one + (place - low) * (other - one)) for one, other in zip(*_STEPS[low : low + 2], strict=True)
    )
    return red, green, blue
