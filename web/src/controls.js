// SPDX-License-Identifier: Apache-2.0
// Mouse, touch and keys. Each changes the camera and calls changed().

const kKeys = {KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyQ: [0, 1, 0], KeyE: [0, -1, 0]};
const kLooks = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
const kTurn = 0.006;      // rad a px
const kSpeed = 0.6;       // distances to the target a second
const kLookSpeed = 0.9;   // rad a second

export class Controls {
    constructor(canvas, camera, changed) {
        Object.assign(this, {canvas, camera, changed, pointers: new Map(), held: new Set(), last: 0});
        canvas.addEventListener("pointerdown", (event) => {
            canvas.setPointerCapture(event.pointerId);
            canvas.focus();
            this.pointers.set(event.pointerId, event);
        });
        for (const end of ["pointerup", "pointercancel"])
            canvas.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
        canvas.addEventListener("pointermove", (event) => this.drag(event));
        canvas.addEventListener("contextmenu", (event) => event.preventDefault());
        canvas.addEventListener("wheel", (event) => {
            event.preventDefault();
            camera.zoom(Math.exp(Math.max(-1, Math.min(1, event.deltaY / 400))));
            changed();
        }, {passive: false});
        addEventListener("keydown", (event) => {
            if (event.ctrlKey || event.metaKey || event.altKey || !(event.code in kKeys || event.code in kLooks)) return;
            event.preventDefault();
            if (this.held.size === 0) {
                this.last = performance.now();
                requestAnimationFrame(() => this.walk());
            }
            this.held.add(event.code);
            this.fast = event.shiftKey;
        });
        addEventListener("keyup", (event) => this.held.delete(event.code));
        addEventListener("blur", () => this.held.clear());
    }

    drag(event) {
        const before = this.pointers.get(event.pointerId);
        if (!before) return;
        const dx = event.clientX - before.clientX, dy = event.clientY - before.clientY;
        if (this.pointers.size === 1) {
            if (event.shiftKey || event.buttons & 6) this.slide(dx, dy);
            else this.camera.orbit(dx * kTurn, dy * kTurn);
        } else {
            const [other] = [...this.pointers.values()].filter((one) => one.pointerId !== event.pointerId);
            const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
            if (apart(event) > 1 && apart(before) > 1) this.camera.zoom(apart(before) / apart(event));
            this.slide(dx / 2, dy / 2);
        }
        this.pointers.set(event.pointerId, event);
        this.changed();
    }

    slide(dx, dy) {
        const {lens} = this.camera.for(this.canvas.clientWidth, this.canvas.clientHeight);
        this.camera.move(-dx / lens[0], -dy / lens[1], 0);
    }

    walk() {
        if (this.held.size === 0) return;
        const now = performance.now(), seconds = Math.min(0.1, (now - this.last) / 1000);
        this.last = now;
        const step = seconds * kSpeed * (this.fast ? 4 : 1);
        for (const key of this.held)
            if (key in kKeys) this.camera.move(...kKeys[key].map((v) => v * step));
            else this.camera.look(...kLooks[key].map((v) => -v * seconds * kLookSpeed));
        this.changed();
        requestAnimationFrame(() => this.walk());
    }
}
