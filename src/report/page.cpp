// SPDX-License-Identifier: Apache-2.0
#include "report/page.h"

#include "report/chart.h"

namespace ewa::report {
namespace {

/// It follows the reader's light or dark setting, and has rules for print. Class js: scripts run.
constexpr const char* kStyle = R"css(
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
.charts { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 330px), 1fr)); gap: 16px; }
figure { margin: 0; }
.chart { display: flex; flex-direction: column; background: var(--card); border: 1px solid var(--rule); border-radius: 8px; padding: 12px 12px 6px; }
.chart figcaption { font-weight: 600; font-size: 14px; margin: 0 4px 6px; }
.chart figcaption span { font-weight: 400; color: var(--soft); } .chart .key { font-size: 13px; }
svg { display: block; width: 100%; height: auto; }
svg .grid { stroke: var(--rule); } svg .axis { stroke: var(--soft); }
svg .tick { fill: var(--soft); font-size: 12px; } svg .label { fill: var(--soft); font-size: 13px; }
svg polyline { fill: none; stroke: var(--line); stroke-width: 2; stroke-linejoin: round; }
svg .raw { stroke-width: 1; opacity: 0.35; } svg .dot { fill: var(--line); }
svg .second { stroke: var(--warn); } svg .second.dot { fill: var(--warn); }
.key::before { content: "●"; color: var(--line); margin: 0 4px 0 0; } .key.second::before { color: var(--warn); }
.band rect { fill: transparent; } .band .dot, .band line { visibility: hidden; }
.band:is(:hover, .at) :is(.dot, line) { visibility: visible; } .band line { stroke: var(--soft); stroke-dasharray: 2 3; }
.chart svg { touch-action: pan-y; margin-top: auto; } .readout { margin: 2px 4px 4px; font-size: 13px; min-height: 20px; color: var(--soft);
  font-variant-numeric: tabular-nums; } .chart:has(.key.second) .readout { min-height: 40px; }
.views { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 330px), 1fr)); gap: 20px 16px;
         align-items: end; margin: 12px 0 0; }
.view { scroll-margin: 20px; }
.view a, .view div { display: grid; grid-template-columns: repeat(3, 1fr); gap: 4px; }
.view a { cursor: zoom-in; border-radius: 4px; } .view a:hover, .view:target a { outline: 2px solid var(--line); }
.view img { display: block; width: 100%; border-radius: 4px; background: #000; }
.view figcaption { margin: 4px 0 0; font-size: 13px; } .view figcaption span { color: var(--soft); }
b { font-weight: 600; overflow-wrap: break-word; }
.full { display: none; } .full:target { display: block; position: fixed; inset: 0; z-index: 1; overflow: auto;
         background: var(--page); padding: 8px 14px 14px; }
html:has(.full:target) { overflow: hidden; }
.full nav { max-width: 1120px; margin: 0 auto; } .full nav p { margin: 4px 0; display: flex; flex-wrap: wrap; gap: 4px 18px; }
.full nav span { color: var(--soft); } .full a, summary { color: var(--line); }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: 8px; margin: 8px auto 0; }
.pair img { display: block; width: 100%; } .pair input, .pair i, .pair span, html:not(.js) .full label { display: none; }
.js .pair { display: block; position: relative; isolation: isolate; cursor: ew-resize; touch-action: pan-y; --at: 50%;
            width: min(100%, calc((100vh - 110px) * var(--ratio))); user-select: none; }
.js .full:has(.actual:checked) .pair { width: var(--width); touch-action: pan-x pan-y; }
.js .pair .render { position: absolute; inset: 0; height: 100%; clip-path: inset(0 0 0 var(--at)); }
.js .pair i { display: block; position: absolute; top: 0; bottom: 0; left: var(--at); width: 2px; margin-left: -1px;
              background: #fff; box-shadow: 0 0 3px #000; }
.js .pair i::after { content: "↔"; position: absolute; top: 50%; left: -15px; width: 32px; line-height: 32px; margin-top: -16px;
                     text-align: center; border-radius: 50%; background: #fff; color: #111; box-shadow: 0 0 3px #000;
                     font-style: normal; }
.js .pair span { display: block; position: absolute; bottom: 8px; left: 8px; padding: 1px 8px; border-radius: 4px;
                 background: #0009; color: #fff; font-size: 13px; } .js .pair span + span { left: auto; right: 8px; }
.js .pair input { display: block; position: absolute; inset: auto 0 0; width: 100%; opacity: 0; pointer-events: none; margin: 0; }
.js .pair:has(input:focus-visible) i { outline: 2px solid var(--line); }
.js .full:has(.differ:checked) .pair { filter: brightness(4); }
.js .full:has(.differ:checked) .render { clip-path: none; mix-blend-mode: difference; }
.js .full:has(.differ:checked) .pair :is(i, span) { display: none; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th { text-align: left; font-weight: 600; color: var(--soft); font-size: 13px; }
th, td { padding: 5px 12px 5px 0; border-bottom: 1px solid var(--rule); vertical-align: top; overflow-wrap: break-word; }
td.number, th.number { text-align: right; white-space: nowrap; }
td.bar { width: 30%; } td.bar i { display: block; height: 10px; margin-top: 6px; background: var(--line); border-radius: 2px; }
.columns { display: grid; align-items: start; grid-template-columns: repeat(auto-fit, minmax(min(100%, 330px), 1fr)); gap: 0 40px; }
details { margin: 8px 0 0; } summary { cursor: pointer; } .wrap { overflow-wrap: anywhere; }
pre { background: var(--card); border: 1px solid var(--rule); border-radius: 8px; padding: 12px 16px; margin: 0;
      white-space: pre-wrap; overflow-wrap: anywhere; font: 13px/1.5 ui-monospace, "DejaVu Sans Mono", monospace; }
@media (max-width: 640px) { .figures { grid-template-columns: repeat(2, 1fr); } main { padding: 24px 14px; }
  .bar { display: none; } th, td { padding-right: 8px; } }
@media print { main { max-width: none; } .view, .chart, tr { break-inside: avoid; } .full { display: none !important; } }
)css";

constexpr const char* kScript = R"js((() => {
  // The slider between image and render: by mouse, touch and arrow keys.
  for (const pair of document.querySelectorAll('.pair')) {
    const range = pair.querySelector('input');
    const show = () => pair.style.setProperty('--at', range.value + '%');
    const drag = event => {
      const box = pair.getBoundingClientRect();
      range.value = 100 * (event.clientX - box.left) / box.width;
      show();
    };
    range.addEventListener('input', show);
    pair.addEventListener('pointerdown', event => {
      if (event.button) return;
      pair.setPointerCapture(event.pointerId);
      range.focus({preventScroll: true});
      drag(event);
      event.preventDefault();
    });
    pair.addEventListener('pointermove', event => pair.hasPointerCapture(event.pointerId) && drag(event));
  }
  const opened = () => document.querySelector('.full:target');
  const focus = () => opened() && opened().querySelector('.pair input').focus({preventScroll: true});
  addEventListener('hashchange', focus);
  focus();
  addEventListener('keydown', event => {
    if (event.key === 'Escape' && opened()) location.hash = opened().querySelector('.close').hash;
  });
  // The values of a chart under the pointer, below its title.
  for (const svg of document.querySelectorAll('.chart svg')) {
    const bands = [...svg.querySelectorAll('.band')], readout = svg.parentNode.querySelector('.readout');
    const texts = bands.map(band => {
      const title = band.querySelector('title'), text = title.textContent;
      title.remove();
      return text;
    });
    let at = -1;
    const show = i => {
      if (i < 0 || i >= bands.length) return;
      if (at >= 0) bands[at].classList.remove('at');
      bands[at = i].classList.add('at');
      readout.textContent = texts[i];
    };
    for (const type of ['pointermove', 'pointerdown'])
      svg.addEventListener(type, event => show(bands.indexOf(event.target.closest('.band'))));
    svg.tabIndex = 0;
    svg.addEventListener('keydown', event => {
      const step = {ArrowLeft: -1, ArrowRight: 1}[event.key];
      if (step) show(at < 0 ? bands.length - 1 : at + step), event.preventDefault();
    });
  }
})();
)js";

}  // namespace

std::string html_page(const std::string& title, const std::string& body) {
    return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
           "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
           escape_html(title) + " – ewa</title>\n<style>" + kStyle +
           "</style>\n<script>document.documentElement.classList.add('js')</script></head>\n<body><main>\n" +
           body + "</main>\n<script>\n" + kScript + "</script></body></html>\n";
}

}  // namespace ewa::report
