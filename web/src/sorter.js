// SPDX-License-Identifier: Apache-2.0
// The order of the splats, near to far, in a worker.

/// The worker's whole program: it must not use names from outside. A message is the positions, 3 floats a splat, or a view,
/// {eye, forward, scene}. It answers a view with {order, eye, forward, scene}; splats behind the camera are not in the order.
function program() {
    let positions, keys, order, other;
    const counts = new Uint32Array(2048), depth = new Float32Array(1), bits = new Uint32Array(depth.buffer);

    function pass(shift, count, from, to) {
        counts.fill(0);
        for (let i = 0; i < count; ++i) ++counts[keys[from[i]] >>> shift & 2047];
        for (let bin = 0, sum = 0; bin < 2048; ++bin) {
            const own = counts[bin];
            counts[bin] = sum;
            sum += own;
        }
        for (let i = 0; i < count; ++i) to[counts[keys[from[i]] >>> shift & 2047]++] = from[i];
    }

    onmessage = ({data}) => {
        if (data instanceof Float32Array) {
            positions = data;
            keys = new Uint32Array(data.length / 3);
            order = new Uint32Array(data.length / 3);
            other = new Uint32Array(data.length / 3);
            return;
        }
        const {eye, forward, scene} = data;
        let count = 0;
        for (let i = 0, at = 0; i < keys.length; ++i, at += 3) {
            depth[0] = (positions[at] - eye[0]) * forward[0] + (positions[at + 1] - eye[1]) * forward[1] +
                       (positions[at + 2] - eye[2]) * forward[2];
            if (!(depth[0] > 0.01)) continue;
            keys[i] = bits[0] >>> 9;  // a positive float sorts as its bits; 22 of them are a ten-thousandth of the depth
            order[count++] = i;
        }
        pass(0, count, order, other);
        pass(11, count, other, order);
        const result = order.slice(0, count);
        postMessage({order: result, eye, forward, scene}, [result.buffer]);
    };
}

export class Sorter {
    /// sorted(order, scene) is called after each sort, with the number of the scene.
    constructor(sorted) {
        const source = URL.createObjectURL(new Blob([`(${program})()`], {type: "text/javascript"}));
        this.worker = new Worker(source);
        URL.revokeObjectURL(source);
        this.busy = false;
        this.scene = 0;      // how often positions were set
        this.done = null;    // the view of the last sort
        this.wanted = null;
        this.worker.onmessage = ({data}) => {
            this.busy = false;
            this.done = data;
            if (data.scene === this.scene) sorted(data.order, data.scene);
            this.start();
        };
    }

    /// Another scene, which is sorted from now on. The array is given away. Returns its number.
    setPositions(positions) {
        this.worker.postMessage(positions, [positions.buffer]);
        this.scene += 1;
        this.start();
        return this.scene;
    }

    /// Sorts for a camera, after the sort that runs.
    sort(eye, forward) {
        this.wanted = {eye, forward};
        this.start();
    }

    /// Whether the last order is that of the wanted view.
    current() { return this.done !== null && !this.busy && this.same(); }

    same() {
        const near = (a, b) => a.every((v, i) => v === b[i]);
        return this.done !== null && this.done.scene === this.scene && near(this.done.eye, this.wanted.eye) &&
               near(this.done.forward, this.wanted.forward);
    }

    start() {
        if (this.busy || this.wanted === null || this.scene === 0 || this.same()) return;
        this.busy = true;
        this.worker.postMessage({...this.wanted, scene: this.scene});
    }
}
