#!/usr/bin/python3
"""Plots frame times of palpate_study_peers over the number of nodes.

    /usr/bin/python3 plot_peers.py DIR OUT     reads DIR/linear_frames.csv, writes OUT/linear_frames.png

Needs Debian's python3-matplotlib and python3-numpy.
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt
import numpy as np

plt.rcParams.update({"font.family": "sans-serif", "font.size": 9, "axes.grid": True, "grid.color": "#e4e4e4",
                     "axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": 10,
                     "legend.frameon": False, "legend.fontsize": 8, "lines.linewidth": 1.6, "lines.markersize": 4})
METHODS = {"LCG": ("#d55e00", "-"), "LCG block-Jacobi": ("#d55e00", "--"),
           "back-solve": ("#009e73", "-"), "PFE": ("#cc79a7", "-"), "linear_dd": ("#0072b2", "-"),
           "linear_dd forces alone": ("#0072b2", ":")}


def error_label(method, rows):
    if method == "back-solve":
        return "back-solve (the reference)"
    return f"{method} (error up to {rows['displacement_error'].astype(float).max():.0e})"


def main():
    source, target = map(Path, sys.argv[1:])
    data = np.genfromtxt(source / "linear_frames.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    contacts = [k for k in np.unique(data["contacts"]) if k in (1, 8, 64)]
    figure, panels = plt.subplots(1, len(contacts), figsize=(3.6 * len(contacts), 4.4), sharey=True)
    for axes, k in zip(panels, contacts):
        for method, (colour, style) in METHODS.items():
            rows = data[(data["contacts"] == k) & (data["method"] == method)]
            axes.loglog(rows["nodes"], rows["median"], style, marker="o", color=colour,
                        label=error_label(method, data[data["method"] == method]))
        axes.axhline(1000, color="#333333", linewidth=0.8)
        axes.set(title=f"{k} contact{'s' if k > 1 else ''}", xlabel="nodes")
    panels[0].text(rows["nodes"].max(), 1000, "1 kHz", ha="right", va="bottom", color="#333333", fontsize=8)
    panels[0].set_ylabel("median of a frame, µs")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=3)
    figure.tight_layout(rect=(0, 0.14, 1, 1))
    figure.savefig(target / "linear_frames.png", dpi=110, metadata={"Software": None})


if __name__ == "__main__":
    main()
