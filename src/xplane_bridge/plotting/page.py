"""The frame of an HTML page that needs no network: style, navigation, tables; its figures share one time axis."""

from __future__ import annotations

import datetime
import html
from typing import Any, Iterable, Sequence, Tuple

import numpy as np

from xplane_bridge import __version__
from xplane_bridge.plotting import interactive

#: Key, title and HTML of a section. Figures that share a time axis stand in an element with the attribute `data-time`.
Section = Tuple[str, str, str]

_STYLE = """
:root { --ink: #1d2733; --soft: #5c6b7a; --line: #dde3e9; --back: #f6f8fa; }
* { box-sizing: border-box; }
body { font: 15px/1.45 system-ui, sans-serif; color: var(--ink); background: var(--back); margin: 0; }
header { background: #14324f; color: #fff; padding: 22px 32px; }
header h1 { margin: 0 0 4px; font-size: 24px; } header p { margin: 0; opacity: .8; }
nav { position: sticky; top: 0; z-index: 5; background: #fff; border-bottom: 1px solid var(--line); padding: 8px 32px;
  display: flex; flex-wrap: wrap; gap: 2px 16px; }
nav a { color: #0b5cad; text-decoration: none; white-space: nowrap; }
main { max-width: 1240px; margin: 0 auto; padding: 16px 24px 60px; }
section { background: #fff; border: 1px solid var(--line); border-radius: 8px; padding: 14px 18px; margin: 18px 0;
  scroll-margin-top: 52px; }
h2 { margin: 2px 0 10px; font-size: 19px; } h3 { margin: 18px 0 6px; font-size: 15px; }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(170px, 1fr)); gap: 10px; }
.card { border: 1px solid var(--line); border-radius: 6px; padding: 8px 12px; }
.card b { display: block; font-size: 19px; } .card span { color: var(--soft); font-size: 13px; }
table { border-collapse: collapse; width: 100%; font-size: 13.5px; }
th, td { text-align: left; padding: 4px 10px 4px 0; border-bottom: 1px solid var(--line); vertical-align: top; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
.missing { color: var(--soft); font-style: italic; }
.bad { color: #b3261e; font-weight: 600; } .good { color: #1b7f3b; }
.strip { display: grid; grid-template-columns: repeat(auto-fill, minmax(250px, 1fr)); gap: 12px; }
.strip figure { margin: 0; border: 1px solid var(--line); border-radius: 6px; overflow: hidden; }
.strip img { width: 100%; display: block; }
.overlay { display: grid; grid-template-columns: repeat(auto-fill, minmax(460px, 1fr)); gap: 12px; }
.overlay figure { margin: 0; border: 1px solid var(--line); border-radius: 6px; overflow: hidden; }
.overlay img { width: 100%; display: block; }
.strip figcaption, .overlay figcaption { padding: 6px 9px; font-size: 12.5px; color: var(--soft); }
"""

#: Zooming one time axis zooms all; the guard keeps the echo of our own change out.
_LINK = """
const figures = [...document.querySelectorAll('[data-time] .plotly-graph-div')];
let busy = false;
figures.forEach(source => source.on('plotly_relayout', change => {
  if (busy) return;
  const key = Object.keys(change).find(k => /^xaxis\\d*\\.(range(\\[0\\])?|autorange)$/.test(k));
  if (!key) return;
  const axis = key.split('.')[0];
  busy = true;
  const jobs = figures.filter(f => f !== source).map(f => {
    const wanted = {};
    Object.keys(f.layout).filter(k => /^xaxis/.test(k)).forEach(k => {
      if (key.endsWith('autorange')) wanted[k + '.autorange'] = true;
      else wanted[k + '.range'] = source.layout[axis].range.slice();
    });
    return Plotly.relayout(f, wanted);
  });
  Promise.all(jobs).finally(() => { busy = false; });
}));
document.body.dataset.linked = figures.length;
"""


def page(title: str, subtitle: str, sections: Sequence[Section]) -> str:
    """Make the page.

    Args:
        title: Its heading, plain text.
        subtitle: The line below, plain text; the package's version is added.
        sections: In order.
    """
    nav = "".join(f'<a href="#{key}">{html.escape(name.split(":")[0])}</a>' for key, name, _ in sections)
    body = "".join(f'<section id="{key}"><h2>{html.escape(name)}</h2>{text}</section>' for key, name, text in sections)
    return (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(title)}</title><style>{_STYLE}</style>"
        f"<script>{interactive.script()}</script></head><body>"
        f"<header><h1>{html.escape(title)}</h1>"
        f"<p>{html.escape(subtitle)} &middot; xplane_bridge {__version__}</p></header>"
        f"<nav>{nav}</nav><main>{body}</main><script>{_LINK}</script></body></html>\n"
    )


def day_of(time_ns: int) -> str:
    """Give a host time as date and time of day."""
    day = datetime.datetime.fromtimestamp(time_ns / 1e9, tz=datetime.timezone.utc)
    return f"{day:%Y-%m-%d %H:%M:%S} UTC"


def missing(text: str) -> str:
    """Say in place of a figure why it is not there."""
    return f'<p class="missing">Not shown: {html.escape(text)}.</p>'


def number(value: Any, digits: int = 4) -> str:
    """Give a number with so many digits; a dash where it is not known, the sign of infinity where it is infinite."""
    number = float(value)
    if np.isnan(number):
        return "&ndash;"
    if np.isinf(number):
        return "&infin;" if number > 0.0 else "-&infin;"
    text = f"{number:.{digits}g}"
    return text if abs(float(text)) < 10**digits else f"{number:,.0f}"  # 9999.7 has five digits once rounded to four


def rows_table(head: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Make a table; cells are HTML already, `numbers` are the columns set to the right."""

    def cell(tag: str, k: int, text: str) -> str:
        return f"<{tag}{' class=n' if k in numbers else ''}>{text}</{tag}>"

    top = "".join(cell("th", k, html.escape(text)) for k, text in enumerate(head))
    body = "".join("<tr>" + "".join(cell("td", k, text) for k, text in enumerate(row)) + "</tr>" for row in rows)
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
