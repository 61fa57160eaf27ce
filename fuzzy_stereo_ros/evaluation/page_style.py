# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How the page of an evaluation looks."""

STYLE = """
:root { --ink: #1c2330; --faint: #5b6575; --line: #d9dee6; --ground: #f6f7f9; --paper: #fff;
        --accent: #1d5fbf; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e3e7ee; --faint: #98a3b5; --line: #343c4a; --ground: #14181f; --paper: #1c222c;
          --accent: #7db2ff; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 1500px; padding: 24px; color: var(--ink);
       background: var(--ground); font: 15px/1.45 system-ui, 'Segoe UI', Roboto, sans-serif; }
h1 { font-size: 26px; margin: 0 0 4px; }
h2 { font-size: 20px; margin: 36px 0 10px; border-bottom: 1px solid var(--line);
     padding-bottom: 4px; }
h3 { font-size: 16px; margin: 20px 0 6px; }
p { margin: 4px 0 10px; max-width: 100ch; }
a { color: var(--accent); text-decoration: none; }
a:hover { text-decoration: underline; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 2px 14px; margin: 10px 0; }
dt { color: var(--faint); }
dd { margin: 0; }
.faint { color: var(--faint); font-weight: normal; font-size: 13px; }
.wide { overflow-x: auto; background: var(--paper); border: 1px solid var(--line);
        border-radius: 6px; width: fit-content; max-width: 100%; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 13.5px; }
th, td { padding: 4px 12px; text-align: right; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; position: sticky; left: 0;
                                 background: var(--paper); }
thead th { border-bottom: 1px solid var(--line); color: var(--faint); font-weight: 600; }
tbody tr:nth-child(even) td { background: color-mix(in srgb, var(--line) 25%, var(--paper)); }
.scene { background: var(--paper); border: 1px solid var(--line); border-radius: 6px;
         padding: 10px 14px 14px; margin: 12px 0; overflow-x: auto; }
.scene h3 { margin-top: 2px; }
.views { display: grid; grid-auto-flow: column; grid-auto-columns: minmax(215px, 1fr);
         grid-template-rows: auto auto auto; gap: 4px 10px; }
.views p { margin: 0; font-size: 12.5px; line-height: 1.35; }
.views strong { display: block; font-size: 13.5px; }
img { width: 100%; display: block; border-radius: 3px; }
.legend { display: flex; flex-wrap: wrap; align-items: center; gap: 6px 18px; font-size: 13px;
          color: var(--faint); }
.legend img { width: 128px; display: inline-block; vertical-align: middle; }
.swatch { display: inline-block; width: 14px; height: 14px; border-radius: 3px;
          vertical-align: -2px; margin-right: 5px; }
@media print { body { background: #fff; } .scene { break-inside: avoid; } }
"""
