"""The table on the screen, a line for each figure."""

from measure.figure import Figure


class Table:
    """Columns of text; the last one is as long as its text."""

    def __init__(self, **widths: int):
        """Each column with its width in characters."""
        self.widths = widths

    def line(self, *cells: str) -> str:
        """A line of the table."""
        padded = (c.ljust(w) for c, w in zip(cells, self.widths.values(), strict=True))
        return "  ".join(padded).rstrip()

    def head(self) -> str:
        """The names of the columns, underlined."""
        names = self.line(*self.widths)
        return f"{names}\n{'-' * (sum(self.widths.values()) + 2 * len(self.widths) - 2)}"


FIGURES = Table(case=46, figure=50, value=11, target=13, error=10, level=9, note=0)


def line(f: Figure) -> str:
    """A figure as a line of ``FIGURES``, with four digits; its target is exact or the bounds."""
    value, error = ("" if x is None else f"{x:.4g}" for x in (f.value, f.error))
    targets = ("{:.4g}", f.reference), (">= {:.4g}", f.least), ("<= {:.4g}", f.most)
    target = " ".join(form.format(x) for form, x in targets if x is not None)
    return FIGURES.line(f.case, f.name, value, target, error, f.level, f.note)
