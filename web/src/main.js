// SPDX-License-Identifier: Apache-2.0
// The page: decodes its scene, and draws it when something changes.
import {openArchive} from "./archive.js";
import {between, Camera} from "./camera.js";
import {Controls} from "./controls.js";
import {Live} from "./live.js";
import {joined, LevelScene, openLevels} from "./levels.js";
import {alongPath} from "./path.js";
import {Renderer} from "./renderer.js";
import {decodeSog} from "./sog.js";
import {Sorter} from "./sorter.js";
import {turn} from "./vector.js";

const byId = (id) => document.getElementById(id);
const state = document.documentElement.dataset;  // for whoever drives the page
const kSecondsAView = 1.5, kSecondsARound = 20;
const kRest = 200;  // ms without a new view, after which levels are chosen

function say(text) {
    byId("message").hidden = text === "";
    byId("text").textContent = text;
    byId("progress").hidden = text !== "Loading";
}

function decoded(base64) {
    try {
        return atob(base64);
    } catch {
        throw new Error("the scene in this page is damaged");
    }
}

function bytesOf(text) {
    const bytes = new Uint8Array(Math.floor(text.length / 4) * 3 - (text.endsWith("==") ? 2 : text.endsWith("=") ? 1 : 0));
    for (let from = 0, at = 0; from < text.length; from += 1 << 16) {
        const part = decoded(text.slice(from, from + (1 << 16)));
        for (let i = 0; i < part.length; ++i) bytes[at++] = part.charCodeAt(i);
    }
    return bytes;
}

class Page {
    constructor(gl, settings) {
        Object.assign(this, {gl, settings, canvas: gl.canvas, renderer: new Renderer(gl), index: -1, film: 0, light: false,
                             coming: null, levels: null, timer: null, rested: ""});
        this.camera = new Camera(this.start(), settings.up, settings.target);
        this.sorter = new Sorter((order, scene) => {
            try {
                // A scene replaces the one before together with its order.
                if (this.coming?.number === scene) this.renderer.setScene(this.coming.scene);
            } catch (error) {
                return fail(error);
            }
            if (this.coming?.number === scene) this.coming = null;
            this.renderer.setOrder(order);
            this.request();
        });
        new Controls(this.canvas, this.camera, () => {
            this.film = 0;
            this.request();
        });
        new ResizeObserver(() => this.request()).observe(this.canvas);
        this.addCommands();
        this.jump();
        this.request();
    }

    /// Shows the scene as soon as it is sorted.
    show(scene) {
        state.splats = scene.count;
        byId("count").textContent = `${scene.count.toLocaleString("en")} splats`;
        const {positions} = scene;
        scene.positions = null;
        this.coming = {scene, number: this.sorter.setPositions(positions)};
        this.request();
    }

    /// Shows the levels of a lod-meta.json that suit the view.
    stream({meta, folder}) {
        this.levels = new LevelScene(this.gl, meta, folder, this.budget(), () => attempt(() => this.refresh()), fail);
        this.rest();
    }

    budget() {
        const wanted = Number(new URLSearchParams(location.hash.slice(1)).get("budget"));
        return wanted > 0 ? wanted : this.settings.budget;
    }

    /// Shows what is loaded of the levels, and says what cannot be.
    refresh() {
        const parts = this.levels.shown(), lost = this.levels.lost.size, all = this.levels.files.length;
        state.levels = this.levels.chosen.join();
        byId("lost").hidden = lost === 0;
        byId("lost").textContent = `${lost} of ${all} parts of the scene could not be loaded. Reload the page to try again.`;
        if (parts.length > 0) this.show(joined(parts));
        else this.request();
    }

    /// Chooses levels once the view has stayed for a moment.
    rest() {
        clearTimeout(this.timer);
        this.timer = setTimeout(() => attempt(() => {
            this.timer = null;
            this.levels.choose(this.camera.eye, this.camera.forward);
            this.request();
        }), kRest);
    }

    /// The view that the address names: #camera=3, #camera=NAME, #film=SECONDS, #light, #budget=N.
    jump() {
        const wanted = new URLSearchParams(location.hash.slice(1));
        this.light = wanted.has("light");
        if (this.levels) {
            this.levels.budget = this.budget();
            this.rest();
        }
        if (wanted.has("film") && this.settings.film) {
            this.film = 0;
            this.index = -1;
            this.camera.show(alongPath(this.settings.film, Number(wanted.get("film")) || 0), this.settings.target);
        }
        if (!wanted.has("camera")) return;
        const name = wanted.get("camera"), found = this.settings.cameras.findIndex((one) => `/${one.name}`.endsWith(`/${name}`));
        this.view(found >= 0 ? found : Number(name) || 0);
    }

    addCommands() {
        const commands = {
            home: () => this.home(),
            previous: () => this.view(this.index < 0 ? -1 : this.index - 1),
            next: () => this.view(this.index + 1),
            play: () => this.play(),
            shade: () => this.shade(),
            full: () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen()),
            about: () => (byId("help").open ? byId("help").close() : byId("help").showModal())
        };
        const keys = {KeyR: "home", BracketLeft: "previous", BracketRight: "next", Space: "play", KeyB: "shade", KeyF: "full",
                      KeyH: "about"};
        for (const id in commands) byId(id).onclick = commands[id];
        addEventListener("keydown", (event) => {
            if (event.ctrlKey || event.metaKey || event.altKey || event.repeat || !(event.code in keys)) return;
            if (event.code === "Space" && event.target instanceof HTMLButtonElement) return;  // it presses the button
            event.preventDefault();
            commands[keys[event.code]]();
        });
        addEventListener("hashchange", () => {
            this.jump();
            this.request();
        });
        const none = this.settings.cameras.length === 0;
        for (const id of ["previous", "next", "where"]) byId(id).hidden = none;
    }

    /// The first view, which fills the window.
    start() {
        const {start, portrait} = this.settings, {clientWidth, clientHeight} = this.canvas;
        return portrait && clientHeight > clientWidth ? portrait : start;
    }

    home() {
        this.index = -1;
        this.film = 0;
        this.camera.show(this.start(), this.settings.target);
        this.request();
    }

    view(index) {
        const {cameras, target} = this.settings;
        if (cameras.length === 0) return;
        this.film = 0;
        this.index = (index % cameras.length + cameras.length) % cameras.length;
        this.camera.show(cameras[this.index], target);
        this.request();
    }

    shade() {
        this.light = !this.light;
        this.request();
    }

    /// The film of the page, without one the views of the photos one after another, or else once round the scene.
    play() {
        this.film = this.film ? 0 : performance.now() - 1;
        this.from = {...this.camera.view, eye: this.camera.eye, rows: this.camera.rows};
        this.request();
    }

    step() {
        const seconds = (performance.now() - this.film) / 1000, {cameras, film, up, target} = this.settings;
        if (film?.length > 1) {
            this.index = -1;
            this.camera.show(alongPath(film, seconds % film[film.length - 1].time), target);
        } else if (cameras.length > 1) {
            const at = seconds / kSecondsAView, first = Math.floor(at) % cameras.length, t = at % 1;
            this.camera.show(between(cameras[first], cameras[(first + 1) % cameras.length], t * t * (3 - 2 * t)), target);
        } else {
            const angle = seconds / kSecondsARound * 2 * Math.PI;
            const eye = turn(this.from.eye.map((v, i) => v - target[i]), up, angle).map((v, i) => v + target[i]);
            this.camera.show({...this.from, eye, rows: this.from.rows.map((row) => turn(row, up, angle))}, target);
        }
    }

    request() {
        if (state.scene !== "failed") state.scene = "drawing";
        if (this.waiting) return;
        this.waiting = true;
        requestAnimationFrame(() => {
            this.waiting = false;
            attempt(() => this.draw());
        });
    }

    draw() {
        if (this.film) this.step();
        const scale = Math.min(devicePixelRatio, 2), {canvas, camera} = this;
        const width = Math.max(1, Math.round(canvas.clientWidth * scale)),
              height = Math.max(1, Math.round(canvas.clientHeight * scale));
        if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
        const view = [...camera.eye, ...camera.forward].join();
        if (this.levels && view !== this.rested) this.rest();
        this.rested = view;
        this.sorter.sort([...camera.eye], [...camera.forward]);
        if (!this.renderer.splats) return;
        this.renderer.draw(camera.for(width, height), width, height, this.light ? [1, 1, 1] : this.settings.background);
        byId("where").textContent = this.index < 0 ? "" : this.settings.cameras[this.index].name;
        byId("play").textContent = this.film ? "⏸" : "▶";
        if (!this.sorter.current() || state.scene === "failed") return;
        if (this.levels && (this.timer !== null || !this.levels.complete())) state.scene = "refining";
        else state.scene = "ready";
        say("");
        if (this.film) this.request();
    }
}

function fail(error) {
    state.scene = "failed";
    say(`The scene cannot be shown: ${error.message}`);
}

function attempt(action) {
    try {
        action();
    } catch (error) {
        fail(error);
    }
}

async function start() {
    const canvas = byId("view"), gl = canvas.getContext("webgl2", {antialias: false, alpha: false, preserveDrawingBuffer: true});
    if (!gl) {
        state.scene = "failed";
        byId("bar").hidden = true;
        return say("This browser shows no WebGL2, which the scene needs. A current Firefox, Chrome, Edge or Safari does; " +
                   "hardware acceleration must be on.");
    }
    canvas.addEventListener("webglcontextlost", () => say("The graphics device was lost. Reload the page."));
    try {
        const settings = JSON.parse(byId("settings").textContent), text = byId("scene").textContent.trim();
        byId("scene").remove();
        if (settings.live) {
            const page = new Page(gl, settings);
            return new Live(gl, (scene, step) => {
                page.show(scene);
                state.step = step;
            }, (part) => { byId("progress").value = part; }, fail).follow();
        }
        if (settings.levels) {
            const opened = await openLevels(settings.levels);
            return new Page(gl, settings).stream(opened);
        }
        const files = openArchive(bytesOf(text));
        const scene = await decodeSog(gl, (name) => files.get(name), (part) => { byId("progress").value = part; });
        new Page(gl, settings).show(scene);
    } catch (error) {
        fail(error);
    }
}

state.scene = "loading";
start();
