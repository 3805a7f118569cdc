// SPDX-License-Identifier: Apache-2.0
// The camera of the page and how it moves. World axes are those of the splats; rows of the view's rotation point right, down
// and forward.
import {add, cross, dot, length, normalize, subtract, turn} from "./vector.js";

const kSteepest = 0.02;  // rad between the view and the up direction

export class Camera {
    /// view: {width, height, fx, fy, cx, cy, rows, eye}; up: unit length; target: the point to orbit.
    constructor(view, up, target) {
        this.up = up;
        this.show(view, target);
    }

    show(view, target = null) {
        this.view = view;
        this.eye = [...view.eye];
        this.rows = view.rows.map((row) => [...row]);
        const ahead = target ? dot(subtract(target, this.eye), this.forward) : 0;
        this.distance = ahead > 0 ? ahead : this.distance ?? 1;
    }

    get forward() { return this.rows[2]; }

    /// Position, rotation and the lens in px for an image of this size, which shows the whole view, centred.
    for(width, height) {
        const {view} = this, scale = Math.min(width / view.width, height / view.height);
        return {eye: this.eye, rows: this.rows,
                lens: [view.fx * scale, view.fy * scale, view.cx * scale + (width - view.width * scale) / 2,
                       view.cy * scale + (height - view.height * scale) / 2]};
    }

    /// Radians about the up direction and about the right axis. Stops before the view is along up.
    angles(yaw, pitch) {
        const steep = Math.acos(Math.max(-1, Math.min(1, dot(this.forward, this.up))));
        const limited = Math.max(kSteepest - steep, Math.min(Math.PI - kSteepest - steep, pitch));
        const right = this.rows[0];
        this.rows = this.rows.map((row) => turn(turn(row, right, -limited), this.up, yaw));
        // Rounding must not add up.
        const forward = normalize(this.rows[2]), across = normalize(cross(this.rows[1], forward));
        this.rows = [across, cross(forward, across), forward];
    }

    orbit(yaw, pitch) {
        const target = add(this.eye, this.forward, this.distance);
        this.angles(yaw, pitch);
        this.eye = add(target, this.forward, -this.distance);
    }

    look(yaw, pitch) { this.angles(yaw, pitch); }

    /// By parts of the distance to the target: right, down, forward.
    move(right, down, forward) {
        this.rows.forEach((row, i) => { this.eye = add(this.eye, row, [right, down, forward][i] * this.distance); });
    }

    zoom(factor) {
        const target = add(this.eye, this.forward, this.distance);
        this.distance *= factor;
        this.eye = add(target, this.forward, -this.distance);
    }
}

/// The view between two: t from 0 to 1.
export function between(a, b, t) {
    const mix = (x, y) => x + (y - x) * t;
    const forward = normalize(a.rows[2].map((v, i) => mix(v, b.rows[2][i])));
    const down = a.rows[1].map((v, i) => mix(v, b.rows[1][i]));
    const right = normalize(cross(down, forward));
    const view = {rows: [right, cross(forward, right), forward], eye: a.eye.map((v, i) => mix(v, b.eye[i]))};
    for (const key of ["width", "height", "fx", "fy", "cx", "cy"]) view[key] = mix(a[key], b[key]);
    return length(right) > 0 ? view : a;
}
