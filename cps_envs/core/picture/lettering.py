"""How wide lines of text are in the viewers' typeface, without a font: browsers have one of the same widths."""

from __future__ import annotations

EM = 0.6875  # of the size that pygame's own font is asked for
BASELINE = 0.3  # em below the middle of a line
FAMILY = "'Liberation Sans', Arimo, Arial, Helvetica, 'Nimbus Sans', sans-serif"  # in bold, all of these widths

# Thousandths of an em from the space on: Helvetica Bold, as FreeSans Bold has them.
_WIDTHS = (
    "278 333 474 556 556 889 722 238 333 333 389 584 278 333 278 278 556 556 556 556 556 556 556 556 556 556 333 "
    "333 584 584 584 611 975 722 722 722 722 667 611 778 722 278 556 722 611 833 722 778 667 778 722 667 611 722 "
    "667 944 667 667 611 333 301 333 584 600 333 556 611 556 611 556 333 611 611 278 278 556 278 889 611 611 611 "
    "611 389 556 333 611 556 778 556 556 500 389 280 389 584 "
)
WIDTHS = {chr(ord(" ") + k): int(width) for k, width in enumerate(_WIDTHS.split())}
OTHERS = 584  # of letters beyond ASCII, on average


def width_of(text: str, size: int) -> float:
    """Width in pixels of a line of text."""
    return sum(WIDTHS.get(letter, OTHERS) for letter in text) / 1000 * EM * size
