// SPDX-License-Identifier: Apache-2.0
// The path of a film through its keys: the smooth one of along_path() in src/scene/camera.h.
import {add, cross, dot, length, normalize, subtract, turn} from "./vector.js";

/// The axes of a camera that turns from `a` to `b` the short way: t from 0 to 1.
function turned(a, b, t) {
    const sum = (terms) => terms.reduce((x, y) => add(x, y));
    const across = sum(a.map((row, i) => cross(row, b[i])));
    const cosine = a.reduce((trace, row, i) => trace + dot(row, b[i]), -1) / 2, sine = length(across) / 2;
    if (sine < 1e-9 && cosine > 0) return a;
    let axis = across;
    if (sine < 1e-9) {  // half a turn: its axis is what it leaves as it is
        const columns = [0, 1, 2].map((j) => add(sum(a.map((row, i) => b[i].map((v) => v * row[j]))), [0, 1, 2].map((k) => +(k === j))));
        axis = columns.reduce((x, y) => (length(x) > length(y) ? x : y));
    }
    const unit = normalize(axis), angle = t * Math.atan2(sine, cosine);
    return a.map((row) => turn(row, unit, angle));
}

/// The view at a time (s). keys: views with times that rise.
export function alongPath(keys, time) {
    const last = keys.length - 1;
    let index = 0;
    while (index + 1 < last && keys[index + 1].time <= time) ++index;
    const first = keys[0], from = keys[index], to = keys[Math.min(index + 1, last)], span = to.time - from.time;
    const t = span > 0 ? Math.max(0, Math.min(1, (time - from.time) / span)) : 0;
    const mean = (i) => subtract(keys[i + 1].eye, keys[i].eye).map((v) => v / (keys[i + 1].time - keys[i].time));
    const velocity = (i) => {
        if (i === 0 || i === last) return mean(i === 0 ? 0 : last - 1);
        const before = keys[i].time - keys[i - 1].time, after = keys[i + 1].time - keys[i].time, next = mean(i);
        return mean(i - 1).map((v, k) => (v * after + next[k] * before) / (before + after));
    };
    const view = {...first};
    for (const f of ["fx", "fy"])
        view[f] = (from[f] * first.width / from.width) ** (1 - t) * (to[f] * first.width / to.width) ** t;
    if (last === 0) return view;
    const way = subtract(to.eye, from.eye), begins = velocity(index), ends = velocity(index + 1);
    view.eye = from.eye.map((v, k) => v + way[k] * t +
                            t * (1 - t) * ((1 - t) * (begins[k] * span - way[k]) - t * (ends[k] * span - way[k])));
    view.rows = turned(from.rows, to.rows, t);
    return view;
}
