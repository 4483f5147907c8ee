"""The figures of this library: made without pyplot, shown by notebooks as they are and by `show` in a window.

Imports matplotlib, so it is imported where a figure is made.
"""

from __future__ import annotations

import io

from matplotlib import figure as of_matplotlib


class Figure(of_matplotlib.Figure):
    """A matplotlib Figure that pyplot learns of when it is shown, and not before.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> figure = Figure()
    >>> figure._repr_png_()[1:4], plt.get_fignums()
    (b'PNG', [])
    """

    def _repr_png_(self) -> bytes:
        """The picture a notebook shows."""
        file = io.BytesIO()
        self.savefig(file, format="png", dpi=self.dpi)
        return file.getvalue()

    def show(self, warn: bool = True) -> None:
        """Open a window and, in a script, wait until it is closed; in a notebook the picture appears.

        Parameters
        ----------
        warn : as matplotlib does, when its backend has no windows; without a display nothing is shown, silently.
        """
        import warnings

        from matplotlib import pyplot as plt

        manager = self.canvas.manager
        if manager is None or not plt.fignum_exists(manager.num):
            plt.figure(FigureClass=lambda **_: self)  # type: ignore[arg-type]  # makes a window for this very figure
        with warnings.catch_warnings():
            if not warn:
                warnings.simplefilter("ignore", UserWarning)
            plt.show()
