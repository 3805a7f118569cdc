# SPDX-License-Identifier: Apache-2.0
"""The diagram of bench/quality.py."""
import html, math

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 740, 420, 64, 210, 36, 52
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6d31")  # as in src/report/chart.cpp


def rms_of(psnr):
    return 10 ** (-psnr / 20)


TIMES = [step * 10.0**power for power in range(-7, 8) for step in (1, 2, 5)]
ERRORS = [rms_of(psnr) for psnr in range(140, -140, -2)]


class Axis:
    """Logarithmic, from tick to tick around the values."""

    def __init__(self, values, every, start, end):
        low = max(tick for tick in every if tick <= min(values) * (1 + 1e-9))
        high = min(tick for tick in every if tick >= max(values) * (1 - 1e-9) and tick > low)
        self.ticks = [tick for tick in every if low <= tick <= high]
        self.start, self.scale = start, (end - start) / math.log(high / low)

    def __call__(self, value):
        return self.start + self.scale * math.log(value / self.ticks[0])


def grid(x, y, title):
    right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM
    line = '<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" stroke="#8a8f94" stroke-opacity="0.4"/>'
    text = '<text x="{:.1f}" y="{:.1f}" text-anchor="{}">{}</text>\n'
    svg = f'<text x="{LEFT}" y="20" font-weight="600" font-size="15">{html.escape(title)}</text>\n'
    for tick in x.ticks:
        svg += line.format(x(tick), TOP, x(tick), bottom) + text.format(x(tick), bottom + 18, "middle", f"{tick:g}")
    for tick in y.ticks:
        svg += line.format(LEFT, y(tick), right, y(tick)) + text.format(LEFT - 6, y(tick) + 4, "end", f"{tick:.2g}")
        svg += text.format(right + 6, y(tick) + 4, "start", f"{-20 * math.log10(tick):.0f} dB")
    svg += text.format((LEFT + right) / 2, HEIGHT - 10, "middle", "seconds of training")
    return svg + (f'<text transform="translate(16 {(TOP + bottom) / 2}) rotate(-90)" text-anchor="middle">'
                  "RMS error of held-out images</text>\n")


def series(x, y, rows, side, color):
    hollow = side == "before"
    dot = f'fill="none" stroke="{color}" stroke-width="2" r="3"' if hollow else f'fill="{color}" r="4"'
    at = [(x(row[side]["seconds"]), y(rms_of(row[side]["psnr"])), row) for row in rows]
    svg = (f'<polyline points="{" ".join(f"{px:.1f},{py:.1f}" for px, py, _ in at)}" fill="none" stroke="{color}" '
           + ('stroke-width="1.5" stroke-dasharray="5 4"/>\n' if hollow else 'stroke-width="2"/>\n'))
    for px, py, row in at:
        svg += (f'<circle cx="{px:.1f}" cy="{py:.1f}" {dot}><title>{html.escape(row["dataset"])}, {row["steps"]:,} steps, {side}: '
                f'{row[side]["seconds"]:.1f} s, {row[side]["psnr"]:.2f} dB</title></circle>\n')
    return svg


def legend(names, sides):
    left, svg = WIDTH - RIGHT + 66, ""
    for i, name in enumerate(names):
        top = TOP + 14 + 22 * i
        svg += (f'<circle cx="{left}" cy="{top - 4}" r="4" fill="{COLORS[i % len(COLORS)]}"/>'
                f'<text x="{left + 10}" y="{top}">{html.escape(name)}</text>\n')
    for i, side in enumerate(sides if len(sides) > 1 else ()):
        top = TOP + 14 + 22 * (len(names) + 0.5 + i)
        dashes = ' stroke-dasharray="5 4"' if side == "before" else ""
        svg += (f'<line x1="{left - 10}" x2="{left + 18}" y1="{top - 4}" y2="{top - 4}" stroke="#70777d" stroke-width="2"{dashes}/>'
                f'<text x="{left + 26}" y="{top}">{side}</text>\n')
    return svg


def svg(rows, names, strategies, sides):
    """Error against run time, one drawing below the other for each strategy, on the same axes. names: of the datasets."""
    points = [row[side] for row in rows for side in sides if row[side]["psnr"] is not None]
    height = HEIGHT * len(strategies)
    text = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}" role="img" '
            'aria-label="Error against run time of training" font-family="system-ui, DejaVu Sans, sans-serif" font-size="12" '
            'fill="#70777d">\n')
    if points:
        x = Axis([point["seconds"] for point in points], TIMES, LEFT, WIDTH - RIGHT)
        y = Axis([rms_of(point["psnr"]) for point in points], ERRORS, HEIGHT - BOTTOM, TOP)
        for i, strategy in enumerate(strategies):
            title = "Training: error against run time" + (f", {strategy}" if strategies != ["default"] else "")
            text += f'<g transform="translate(0 {HEIGHT * i})">\n' + grid(x, y, title) + legend(names, sides)
            for number, name in enumerate(names):
                for side in sides:
                    mine = [row for row in rows if (row["strategy"], row["dataset"]) == (strategy, name)
                            and row[side]["psnr"] is not None]
                    text += series(x, y, mine, side, COLORS[number % len(COLORS)])
            text += "</g>\n"
    return text + "</svg>\n"
