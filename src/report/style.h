// SPDX-License-Identifier: Apache-2.0
// The style sheet of the report. It follows the reader's light or dark setting, and has rules for print.
#pragma once

namespace ewa::report {

inline constexpr const char* kStyle = R"css(
:root { color-scheme: light dark; --ink: #1d2227; --soft: #5d6872; --page: #fbfbf9; --card: #ffffff; --rule: #dfe3e6;
        --line: #1668a8; --warn: #9a5b00; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e9ec; --soft: #9aa5af; --page: #14171a; --card: #1c2024; --rule: #333a41; --line: #62b0ec;
          --warn: #e0a84a; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink); font: 15px/1.5 system-ui, "DejaVu Sans", sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 36px 24px 60px; }
h1 { font-size: 27px; line-height: 1.2; margin: 0; font-weight: 650; letter-spacing: -0.01em; }
h2 { font-size: 17px; margin: 40px 0 12px; font-weight: 650; }
p { margin: 6px 0; } .soft { color: var(--soft); } .warn { color: var(--warn); }
.figures { display: grid; grid-template-columns: repeat(4, 1fr); gap: 1px; margin: 24px 0 0;
           background: var(--rule); border: 1px solid var(--rule); border-radius: 8px; overflow: hidden; }
.figures div { background: var(--card); padding: 12px 16px; }
.figures b { display: block; font-size: 22px; white-space: nowrap; font-weight: 600; font-variant-numeric: tabular-nums; }
.figures span { color: var(--soft); font-size: 13px; }
.charts { display: grid; grid-template-columns: repeat(auto-fill, minmax(330px, 1fr)); gap: 16px; }
figure { margin: 0; }
.chart { background: var(--card); border: 1px solid var(--rule); border-radius: 8px; padding: 12px 12px 6px; }
.chart figcaption { font-weight: 600; font-size: 14px; margin: 0 4px 6px; }
.chart figcaption span { font-weight: 400; color: var(--soft); }
svg { display: block; width: 100%; height: auto; }
svg .grid { stroke: var(--rule); } svg .axis { stroke: var(--soft); }
svg .tick { fill: var(--soft); font-size: 12px; } svg .label { fill: var(--soft); font-size: 13px; }
svg polyline { fill: none; stroke: var(--line); stroke-width: 2; stroke-linejoin: round; }
svg .raw { stroke-width: 1; opacity: 0.35; } svg .dot { fill: var(--line); }
.view { margin: 0 0 22px; } .view figcaption { margin: 0 0 6px; }
.view figcaption b { font-weight: 600; overflow-wrap: anywhere; }
.trio { display: grid; grid-template-columns: repeat(3, 1fr); gap: 8px; }
.trio div { font-size: 13px; color: var(--soft); }
.trio img { display: block; width: 100%; border-radius: 4px; background: #000; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th { text-align: left; font-weight: 600; color: var(--soft); font-size: 13px; }
th, td { padding: 5px 12px 5px 0; border-bottom: 1px solid var(--rule); vertical-align: top; overflow-wrap: anywhere; }
td.number, th.number { text-align: right; white-space: nowrap; }
td.bar { width: 45%; } td.bar i { display: block; height: 10px; margin-top: 6px; background: var(--line); border-radius: 2px; }
.columns { display: grid; align-items: start; grid-template-columns: repeat(auto-fit, minmax(330px, 1fr)); gap: 0 40px; }
pre { background: var(--card); border: 1px solid var(--rule); border-radius: 8px; padding: 12px 16px; margin: 0;
      white-space: pre-wrap; overflow-wrap: anywhere; font: 13px/1.5 ui-monospace, "DejaVu Sans Mono", monospace; }
@media (max-width: 640px) { .figures { grid-template-columns: repeat(2, 1fr); } main { padding: 24px 14px; } }
@media print { main { max-width: none; } .view, .chart, tr { break-inside: avoid; } }
)css";

}  // namespace ewa::report
