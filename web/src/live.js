// SPDX-License-Identifier: Apache-2.0
// A training that runs: its state, curves and splats, from the server that the page comes from (src/live/server.h).
import {openArchive} from "./archive.js";
import {decodeSog} from "./sog.js";

const kPause = 1000;       // ms between requests
const kSilence = 20000;    // ms after which a request for the state has failed
const kLongest = 600000;   // the same for splats, which the server first has to encode
const kPaceLines = 10;     // of metrics, that the time left comes from
const kLeastLoss = 1e-9;   // of the curve, whose scale is logarithmic

const byId = (id) => document.getElementById(id);
const page = document.documentElement.dataset;  // for whoever drives the page

/// The points of a polyline in a box of 100 x 40, of the lines of metrics that have a finite value.
export function curve(lines, steps, valueOf) {
    const shown = lines.filter((line) => Number.isFinite(valueOf(line))), values = shown.map(valueOf);
    const low = Math.min(...values), range = Math.max(...values) - low || 1;
    return shown.map(({step}, i) => `${(100 * step / steps).toFixed(2)},${(38 - 36 * (values[i] - low) / range).toFixed(2)}`);
}

/// Seconds to the end of the run, if it continues as in its last lines of metrics; NaN if they do not suffice.
export function secondsLeft({step, steps}, lines) {
    const last = lines[lines.length - 1], before = lines[Math.max(0, lines.length - 1 - kPaceLines)];
    const pace = lines.length < 2 ? NaN : (last.wall_seconds - before.wall_seconds) / (last.step - before.step);
    return pace > 0 ? pace * Math.max(0, steps - step) : NaN;
}

export function duration(seconds) {
    const minutes = Math.round(seconds / 60);
    if (seconds < 60) return `${Math.round(seconds)} s`;
    return minutes < 60 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

export class Live {
    /// show(scene, step) gets each set of splats, as decodeSog returns it. progress(0..1) is called while one is decoded;
    /// failed(error) where that fails.
    constructor(gl, show, progress, failed) {
        Object.assign(this, {gl, show, progress, failed, status: null, lines: [], tag: "", step: -1, lost: false});
    }

    follow() {
        this.repeat(() => this.askState());
        this.repeat(() => this.askSplats());
    }

    async repeat(ask) {
        for (;;) {
            await ask();
            await new Promise((resolve) => setTimeout(resolve, kPause));
        }
    }

    async askState() {
        try {
            const answer = await fetch(`status?metrics=${this.lines.length}`, {signal: AbortSignal.timeout(kSilence)});
            if (!answer.ok) throw new Error(answer.statusText);
            const status = await answer.json();
            // Another run answers at this address: its views are others.
            if (this.status && status.run !== this.status.run) return location.reload();
            this.status = status;
            this.lines.push(...status.metrics);
            this.lost = false;
        } catch {
            this.lost = true;
        }
        this.say();
    }

    /// Splats of the present step, or those that the server has. Nobody looks at a hidden page.
    async askSplats() {
        if (document.hidden || this.step === this.status?.step) return;
        let bytes, tag, step;
        try {
            const headers = this.tag === "" ? {} : {"If-None-Match": this.tag};
            const answer = await fetch("scene", {headers, signal: AbortSignal.timeout(kLongest)});
            if (!answer.ok) return;  // there are no newer ones, or the server has no time
            tag = answer.headers.get("ETag");
            step = Number(answer.headers.get("Ewa-Step"));
            bytes = new Uint8Array(await answer.arrayBuffer());
        } catch {
            return;  // askState shows that the connection is lost
        }
        Object.assign(this, {tag, step});
        try {
            const files = openArchive(bytes);
            this.show(await decodeSog(this.gl, (name) => files.get(name), this.progress), step);
        } catch (error) {
            this.failed(error);
        }
    }

    say() {
        const {status, lines, lost} = this;
        byId("run").hidden = false;
        page.run = lost && status?.state !== "done" ? "lost" : status.state;
        const word = {running: "Training", paused: "Paused", done: "Done", lost: "Connection lost, trying again"}[page.run];
        if (!status) return void (byId("state").textContent = `${word}.`);
        const number = (value) => value.toLocaleString("en"), left = page.run === "running" ? secondsLeft(status, lines) : NaN;
        byId("state").textContent = `${word}: step ${number(status.step)} of ${number(status.steps)}, ${number(status.splats)} splats` +
                                    (left >= 0 ? `, about ${duration(left)} left` : "");
        const loss = curve(lines, status.steps, (line) => Math.log(Math.max(kLeastLoss, line.loss ?? NaN)));
        const psnr = curve(lines, status.steps, (line) => line.test_psnr);
        byId("loss").setAttribute("points", loss.join(" "));
        byId("psnr").setAttribute("points", psnr.join(" "));
        const last = lines.findLast(({test_psnr}) => Number.isFinite(test_psnr));
        byId("loss-now").textContent = status.loss === null ? "" : `loss ${status.loss.toFixed(4)}`;
        byId("psnr-now").textContent = last ? `held-out PSNR ${last.test_psnr.toFixed(2)} dB` : "";
        page.points = loss.length;
    }
}
