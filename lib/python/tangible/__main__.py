"""The programs' work from a shell: `python -m tangible FILE` runs, fits or plans what a file says."""

from __future__ import annotations

import argparse
import json
import os
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

from . import TangibleError, __version__, fit, plan, simulate
from ._plain import write_whole
from ._problem import object_of, text_of
from ._trajectory import COMPONENTS, UNITS

# What --out writes, by the end of its name.
_FORMS = {"scene": (".csv", ".html"), "fit": (".json",), "problem of control": (".csv", ".html", ".json")}
_EPILOG = """\
A scene is run: its final state is printed, or --out writes the trajectory (.csv) or an animated view
(.html). A fit is made: its parameters are printed with their 95 % intervals; --report writes the report
as a page, --out the result (.json). Of a problem of control the plan is made: its status and cost are
printed; --out writes the controls (.csv), an animated view (.html) or the result (.json).

Exit status 0: done; 1: bad input, or a run, fit or plan that has failed, with one line on stderr; 2: wrong
usage."""


def _table(rows: Sequence[Sequence[str]]) -> str:
    """Columns of texts, the first one to the left."""
    widths = [max(map(len, column)) for column in zip(*rows)]
    return "\n".join(
        "  ".join([row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:]))])
        for row in rows
    )


def _kind(file: str) -> str:
    """What a file is, by its keys; of one that is no JSON a scene, of which reading says what is wrong."""
    data = object_of(text_of(file))
    if data is None or "bodies" in data:
        return "scene"
    if "observations" in data or "recordings" in data:
        return "fit"
    if "controls" in data or "cost" in data:
        return "problem of control"
    raise TangibleError(
        f"{file}: expected a scene (bodies), a fit (observations or recordings) or a problem of control "
        f"(controls, cost), got the keys {', '.join(data) or 'none'}"
    )


def _simulate(file: str, out: str | None, report: str | None) -> str:
    run = simulate(file, on_failure="return")
    if out is None:
        heads = ["body", *(f"{name} ({UNITS[name]})" for name in COMPONENTS)]
        rows = [[body, *(f"{run[f'{body}/{name}'][-1]:.6g}" for name in COMPONENTS)] for body in run.bodies]
        print(f"at {run.times[-1]:g} s")
        print(_table([heads, *rows]))
    elif out.endswith(".csv"):
        run.to_csv(out)
    else:
        run.show(out)
    return "" if run.status == "done" else f"{file}: {run.message}"


def _fit(file: str, out: str | None, report: str | None) -> str:
    found = fit(file, on_failure="return")

    def end(value: float | None) -> str:
        return "-" if value is None else f"{value:.6g}"

    rows = [["parameter", "estimate", "95 % from", "to"]]
    for name, ends in found.intervals.items():
        rows.append([name, end(found.estimates.get(name)), *map(end, ends or (None, None))])
    print(_table(rows))
    if report is not None and found.report():
        found.report(report)
    if out is not None:
        write_whole(out, json.dumps(found.data) + "\n")
    return "" if found.status == "converged" else f"{file}: {found.status}: {found.message}"


def _plan(file: str, out: str | None, report: str | None) -> str:
    found = plan(file, on_failure="return")
    print(f"{found.status}, cost {found.cost:.6g}, in the motion {found.motion.cost:.6g}")
    if out is not None and out.endswith(".csv"):
        found.save(out)
    elif out is not None and out.endswith(".html"):
        found.show(out)
    elif out is not None:
        write_whole(out, json.dumps(found.data) + "\n")
    return "" if found.holds else f"{file}: {found.status}: {found.message}"


def _same(file: str, other: str) -> bool:
    try:
        return os.path.samefile(file, other)
    except OSError:
        return os.path.abspath(file) == os.path.abspath(other)


def main(arguments: Sequence[str] | None = None) -> int:
    """Does what the arguments of a command line say, by default those of the process.

    Returns:
        The exit status, 0 or 1; wrong usage ends with `SystemExit(2)`, --help with `SystemExit(0)`.
    """
    parser = argparse.ArgumentParser(
        prog="python -m tangible", description="Runs a scene, makes a fit, or plans controls.", epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False,
    )
    parser.add_argument("file", metavar="FILE", help="a scene, a fit or a problem of control, as JSON")
    parser.add_argument("--out", metavar="FILE", help="what is found, by the end of the name")
    parser.add_argument("--report", metavar="FILE.html", help="the report of a fit")
    parser.add_argument("--version", action="version", version=f"tangible {__version__}")
    given = parser.parse_args(arguments)
    try:
        kind = _kind(given.file)
    except TangibleError as error:
        print(error, file=sys.stderr)
        return 1
    if given.out is not None and not given.out.endswith(_FORMS[kind]):
        parser.error(f"--out: expected a name that ends in {' or '.join(_FORMS[kind])} for a {kind}, got {given.out}")
    if given.report is not None and kind != "fit":
        parser.error(f"--report: expected a fit, got a {kind}")
    named = [name for name in (given.file, given.out, given.report) if name is not None]
    if any(_same(a, b) for i, a in enumerate(named) for b in named[:i]):
        parser.error(f"expected files that differ, got {', '.join(named)}")
    for name in named[1:]:  # which are to be written
        if not Path(name).parent.is_dir():
            print(f"{name}: cannot be written: no such folder", file=sys.stderr)
            return 1
    work = {"scene": _simulate, "fit": _fit, "problem of control": _plan}[kind]
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            failure = work(given.file, given.out, given.report)
        for warning in caught:
            print(f"warning: {warning.message}", file=sys.stderr)
        sys.stdout.flush()
    except TangibleError as error:
        failure = str(error)
    except OSError as error:
        failure = f"{error.filename or given.file}: {error.strerror}"
    if failure:
        print(failure, file=sys.stderr)
    return 1 if failure else 0


if __name__ == "__main__":
    sys.exit(main())
