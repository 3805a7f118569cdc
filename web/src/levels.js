// SPDX-License-Identifier: Apache-2.0
// A scene in levels of detail: a lod-meta.json and its chunks beside the page (src/io/splats/levels.h describes the layout).
import {Heap} from "./heap.js";
import {decodeSog} from "./sog.js";

const kMostLoads = 2;               // at once
const kKept = 2;                    // budgets of splats in memory; more only if they are on the screen or of the coarsest level
const kPauses = [500, 2000, 8000];  // ms before a chunk that failed to load is asked for again
const kSilence = 30000;             // ms without a byte after which a request has failed

/// The leaves of the tree: {middle, radius, rows}. rows[level] is {file, offset, count}, or missing where the leaf has no splats.
export function leavesOf(meta) {
    const leaves = [];
    const visit = (node) => {
        for (const child of node.children ?? []) visit(child);
        if (!node.lods) return;
        const {min, max} = node.bound, rows = [];
        for (const level in node.lods) if (node.lods[level].count > 0) rows[level] = node.lods[level];
        if (rows.length === 0) return;
        leaves.push({middle: min.map((v, i) => (v + max[i]) / 2), radius: Math.hypot(...max.map((v, i) => v - min[i])) / 2, rows,
                     errors: node.errors});
    };
    visit(meta.tree);
    return leaves;
}

/// What a leaf lacks at a level, where 0 is nothing.
function errorOf(leaf, level) {
    if (leaf.errors?.[level] !== undefined) return leaf.errors[level];
    const finest = leaf.rows.find((rows) => rows);
    return Math.log(finest.count / leaf.rows[level].count);
}

/// The level of each leaf for an eye. All start at their coarsest. Steps to the next finer one are bought, the one first that removes the
/// most error on the screen per splat, until the next does not fit the budget of splats: skipping it would make levels flicker.
export function chooseLevels(leaves, eye, forward, budget) {
    const chosen = leaves.map((leaf) => leaf.rows.length - 1);
    let left = budget;
    leaves.forEach((leaf, i) => { left -= leaf.rows[chosen[i]].count; });
    const stepOf = (i) => {
        const leaf = leaves[i];
        let finer = chosen[i] - 1;
        while (finer >= 0 && !leaf.rows[finer]) --finer;
        if (finer < 0) return null;
        const way = leaf.middle.map((v, k) => v - eye[k]), ahead = way.reduce((sum, v, k) => sum + v * forward[k], 0);
        const distance = Math.max(Math.hypot(...way) - leaf.radius, 0.2 * leaf.radius, 1e-9);
        const seen = ahead > -leaf.radius ? 1 : 0.05;  // what is behind may come into view
        const added = Math.max(1, leaf.rows[finer].count - leaf.rows[chosen[i]].count);
        const removed = Math.max(0, errorOf(leaf, chosen[i]) - errorOf(leaf, finer));
        return {i, finer, added, value: seen * (leaf.radius / distance) ** 2 * removed / added};
    };
    const steps = new Heap((a, b) => a.value > b.value || (a.value === b.value && a.i < b.i));
    leaves.forEach((leaf, i) => steps.add(stepOf(i)));
    for (let best = steps.take(); best && best.added <= left; best = steps.take()) {
        left -= best.added;
        chosen[best.i] = best.finer;
        steps.add(stepOf(best.i));
    }
    return chosen;
}

/// The bytes of a file. A server may fall silent at any time.
async function fetched(url) {
    const stop = new AbortController(), fault = () => { throw new Error(`${url} cannot be reached`); };
    let timer = null;
    const next = (part) => {
        clearTimeout(timer);
        timer = setTimeout(() => stop.abort(), kSilence);
        return part.catch(fault);
    };
    try {
        const answer = await next(fetch(url, {signal: stop.signal}));
        if (!answer.ok) throw new Error(`${url} is missing (${answer.status})`);
        const reader = answer.body.getReader(), parts = [];
        for (let part = await next(reader.read()); !part.done; part = await next(reader.read())) parts.push(part.value);
        return new Uint8Array(await new Blob(parts).arrayBuffer());
    } finally {
        clearTimeout(timer);
    }
}

export class LevelScene {
    /// changed() is called when other splats can be shown, and when a chunk is given up; failed(error) when no chunk is left.
    /// folder: the address of the lod-meta.json's folder, empty or with its slash.
    constructor(gl, meta, folder, budget, changed, failed) {
        Object.assign(this, {gl, folder, budget, changed, failed, leaves: leavesOf(meta), files: meta.filenames});
        // Each chunk on the screen takes a layer of a texture, and three rows of another.
        this.mostChunks = Math.min(gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS), Math.floor(gl.getParameter(gl.MAX_TEXTURE_SIZE) / 3));
        this.chunks = new Map();  // by file: {scene, used, failures, idle}; scene is null until it is loaded
        this.lost = new Set();    // files of chunks that were given up
        this.degrees = new Map(); // of SH, by file, of the chunks that have any
        this.view = null;
        this.loads = this.time = 0;
        this.chosen = this.suited();
        this.load();
    }

    /// The levels that suit the last view. Leaves far away stay at their coarsest where the device takes no more chunks.
    suited() {
        const coarsest = this.leaves.map((leaf) => leaf.rows.length - 1);
        const fileOf = (i, level) => this.leaves[i].rows[level].file, files = new Set(coarsest.map((level, i) => fileOf(i, level)));
        if (files.size > this.mostChunks)
            throw new Error(`its coarsest level has ${files.size} chunks, and this device takes ${this.mostChunks}`);
        if (!this.view) return coarsest;
        const {eye, forward} = this.view, chosen = chooseLevels(this.leaves, eye, forward, this.budget);
        const far = this.leaves.map(({middle}) => Math.hypot(...middle.map((v, k) => v - eye[k])));
        for (const i of [...chosen.keys()].sort((a, b) => far[a] - far[b])) {
            const file = fileOf(i, chosen[i]);
            if (files.size < this.mostChunks || files.has(file)) files.add(file);
            else chosen[i] = coarsest[i];
        }
        return chosen;
    }

    choose(eye, forward) {
        this.view = {eye: [...eye], forward: [...forward]};
        const chosen = this.suited();
        if (chosen.every((level, i) => level === this.chosen[i])) return;
        this.chosen = chosen;
        this.load();
        this.changed();
    }

    /// Whether all that is chosen is there.
    complete() { return this.leaves.every((leaf, i) => this.chunks.get(leaf.rows[this.chosen[i]].file)?.scene); }

    /// The chunks that are needed: of the coarsest level first, so that the whole of the scene shows early.
    wanted() {
        const coarse = new Set(), fine = new Set();
        this.leaves.forEach((leaf, i) => {
            coarse.add(leaf.rows[leaf.rows.length - 1].file);
            fine.add(leaf.rows[this.chosen[i]].file);
        });
        return [...coarse, ...fine];
    }

    load() {
        for (const file of this.wanted()) {
            if (this.loads >= kMostLoads) return;
            const chunk = this.chunks.get(file) ?? {scene: null, used: 0, failures: 0, idle: true};
            if (!chunk.idle) continue;
            this.chunks.set(file, chunk);
            chunk.idle = false;
            ++this.loads;
            const missed = (error) => this.miss(file, chunk, error);
            this.open(file).then((scene) => { chunk.scene = scene; }, missed).finally(() => { --this.loads; }).then(() => {
                this.load();
                if (chunk.scene || this.lost.has(file)) this.changed();
            }).catch(this.failed);
        }
    }

    async decoded(file) {
        const name = this.files[file], folder = this.folder + name.slice(0, name.lastIndexOf("/") + 1);
        return decodeSog(this.gl, (part) => fetched(folder + part), () => {});
    }

    /// Chunks on the screen have one SH degree: that of most chunks so far, and of the first where there are as many of another.
    async open(file) {
        const scene = await this.decoded(file);
        if (!scene.palette) return scene;
        this.degrees.set(file, scene.degree);
        const counts = new Map(), error = (odd) => new Error(`${this.files[odd]} differs in its SH degree from other chunks`);
        for (const degree of this.degrees.values()) counts.set(degree, (counts.get(degree) ?? 0) + 1);
        const [degree] = [...counts].reduce((best, next) => (next[1] > best[1] ? next : best));
        for (const [odd, chunk] of this.chunks) {
            if (!chunk.scene?.palette || chunk.scene.degree === degree) continue;
            chunk.scene = null;
            this.lose(odd, error(odd));
        }
        if (scene.degree !== degree) throw error(file);
        return scene;
    }

    /// Asks for a chunk that failed to load once more, after a pause, or gives it up.
    miss(file, chunk, error) {
        const pause = kPauses[chunk.failures++];
        if (pause === undefined) return this.lose(file, error);
        setTimeout(() => {
            chunk.idle = true;
            this.load();
        }, pause);
    }

    /// Goes on without a chunk: leaves have the levels of the others. Those that would need more coarsest chunks than the device takes
    /// are left out.
    lose(file, error) {
        this.lost.add(file);
        const coarsest = ({rows}) => rows[rows.length - 1]?.file, kept = [], moved = [];
        for (const leaf of this.leaves) {
            const {rows} = leaf, isMoved = coarsest(leaf) === file;
            rows.forEach((row, level) => { if (row.file === file) delete rows[level]; });
            while (rows.length > 0 && !rows[rows.length - 1]) --rows.length;
            if (rows.length > 0) (isMoved ? moved : kept).push(leaf);
        }
        const files = new Set(kept.map(coarsest));
        for (const leaf of moved) {
            if (files.size >= this.mostChunks && !files.has(coarsest(leaf))) continue;
            files.add(coarsest(leaf));
            kept.push(leaf);
        }
        this.leaves = kept;
        this.chosen = this.suited();
        if (this.leaves.length === 0) this.failed(error);
    }

    /// The rows to show: of each leaf the chosen level, or the nearest coarser one that is loaded, or else a finer one.
    shown() {
        const parts = [], files = new Set(this.wanted());
        ++this.time;
        this.leaves.forEach((leaf, i) => {
            const levels = [];
            for (let level = this.chosen[i]; level < leaf.rows.length; ++level) levels.push(level);
            for (let level = this.chosen[i] - 1; level >= 0; --level) levels.push(level);
            const row = leaf.rows[levels.find((level) => this.chunks.get(leaf.rows[level]?.file)?.scene &&
                                                         (files.size < this.mostChunks || files.has(leaf.rows[level].file)))];
            if (!row) return;
            files.add(row.file);
            const {file, offset, count} = row, chunk = this.chunks.get(file);
            chunk.used = this.time;
            parts.push({chunk: chunk.scene, offset, count});
        });
        this.forget();
        return parts;
    }

    /// Drops the chunks that have not been on the screen for longest.
    forget() {
        const coarse = new Set(this.leaves.map((leaf) => leaf.rows[leaf.rows.length - 1].file));
        const loaded = [...this.chunks].filter(([, {scene}]) => scene);
        const spare = loaded.filter(([file, {used}]) => used < this.time && !coarse.has(file));
        let count = loaded.reduce((sum, [, {scene}]) => sum + scene.count, 0);
        spare.sort((a, b) => a[1].used - b[1].used);
        for (const [file, {scene}] of spare) {
            if (count <= kKept * this.budget) return;
            count -= scene.count;
            this.chunks.delete(file);
        }
    }
}

/// One scene of several parts of chunks, as decodeSog makes it. `chunk` of a splat is the eighth word of packed.
export function joined(parts) {
    const chunks = [...new Set(parts.map(({chunk}) => chunk))];
    const degree = Math.max(0, ...chunks.map((chunk) => chunk.degree));
    const count = parts.reduce((sum, part) => sum + part.count, 0);
    const packed = new Uint32Array(8 * count), positions = new Float32Array(3 * count);
    let at = 0;
    for (const {chunk, offset, count: rows} of parts) {
        packed.set(chunk.packed.subarray(8 * offset, 8 * (offset + rows)), 8 * at);
        positions.set(chunk.positions.subarray(3 * offset, 3 * (offset + rows)), 3 * at);
        const index = chunks.indexOf(chunk);
        for (let i = at; i < at + rows; ++i) packed[8 * i + 7] = index;
        at += rows;
    }
    const codebooks = new Float32Array(768 * chunks.length);
    chunks.forEach((chunk, i) => codebooks.set(chunk.codebooks, 768 * i));
    return {count, degree, antialias: chunks.some((chunk) => chunk.antialias), positions, packed, codebooks, palette: null,
            palettes: degree > 0 ? chunks.map((chunk) => chunk.palette) : [], chunks: chunks.length};
}

/// {meta, folder} of a lod-meta.json beside the page.
export async function openLevels(name) {
    if (location.protocol === "file:")
        throw new Error("its levels come from a web server; in its folder, python3 -m http.server is one");
    const address = name.split("/").map(encodeURIComponent).join("/");
    return {meta: JSON.parse(new TextDecoder().decode(await fetched(address))), folder: address.slice(0, address.lastIndexOf("/") + 1)};
}
