// SPDX-License-Identifier: Apache-2.0
// A scene in levels of detail: a lod-meta.json and its chunks beside the page (src/io/splats/levels.h describes the layout).
import {decodeSog} from "./sog.js";

const kMostLoads = 2;  // at once
const kKept = 3;       // budgets of splats that stay loaded beside those on the screen

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
    const steps = leaves.map((leaf, i) => stepOf(i)).filter((step) => step);
    while (steps.length > 0) {
        let best = 0;
        for (let k = 1; k < steps.length; ++k) if (steps[k].value > steps[best].value) best = k;
        const {i, finer, added} = steps[best];
        if (added > left) break;
        left -= added;
        chosen[i] = finer;
        const next = stepOf(i);
        if (next) steps[best] = next;
        else steps.splice(best, 1);
    }
    return chosen;
}

async function fetched(url) {
    const answer = await fetch(url);
    if (!answer.ok) throw new Error(`${url} is missing (${answer.status})`);
    return answer;
}

export class LevelScene {
    /// changed() is called when other splats can be shown; failed(error) when a part cannot be loaded.
    constructor(gl, meta, budget, changed, failed) {
        Object.assign(this, {gl, budget, changed, failed, leaves: leavesOf(meta), files: meta.filenames});
        this.chunks = new Map();  // by file: {scene, used}; scene is null while it loads
        this.chosen = this.leaves.map((leaf) => leaf.rows.length - 1);
        this.loads = this.time = 0;
        this.load();
    }

    choose(eye, forward) {
        const chosen = chooseLevels(this.leaves, eye, forward, this.budget);
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
            if (this.chunks.has(file)) continue;
            this.chunks.set(file, {scene: null, used: 0});
            ++this.loads;
            this.open(file).then((scene) => {
                this.chunks.get(file).scene = scene;
                --this.loads;
                this.load();
                this.changed();
            }).catch(this.failed);
        }
    }

    async open(file) {
        const name = this.files[file], folder = name.slice(0, name.lastIndexOf("/") + 1);
        return decodeSog(this.gl, async (part) => new Uint8Array(await (await fetched(folder + part)).arrayBuffer()), () => {});
    }

    /// The rows to show: of each leaf the chosen level, or the nearest coarser one that is loaded, or else a finer one.
    shown() {
        const parts = [];
        ++this.time;
        this.leaves.forEach((leaf, i) => {
            const levels = [];
            for (let level = this.chosen[i]; level < leaf.rows.length; ++level) levels.push(level);
            for (let level = this.chosen[i] - 1; level >= 0; --level) levels.push(level);
            const level = levels.find((one) => leaf.rows[one] && this.chunks.get(leaf.rows[one].file)?.scene);
            if (level === undefined) return;
            const {file, offset, count} = leaf.rows[level], chunk = this.chunks.get(file);
            chunk.used = this.time;
            parts.push({chunk: chunk.scene, offset, count});
        });
        this.forget();
        return parts;
    }

    forget() {
        const coarse = new Set(this.leaves.map((leaf) => leaf.rows[leaf.rows.length - 1].file));
        const spare = [...this.chunks].filter(([file, {scene, used}]) => scene && used < this.time && !coarse.has(file));
        spare.sort((a, b) => b[1].used - a[1].used);
        let count = 0;
        for (const [file, {scene}] of spare) {
            count += scene.count;
            if (count > kKept * this.budget) this.chunks.delete(file);
        }
    }
}

/// One scene of several parts of chunks, as decodeSog makes it. `chunk` of a splat is the eighth word of packed.
export function joined(parts) {
    const chunks = [...new Set(parts.map(({chunk}) => chunk))];
    const degree = Math.max(0, ...chunks.map((chunk) => chunk.degree));
    if (chunks.some((chunk) => chunk.palette && chunk.degree !== degree)) throw new Error("its chunks differ in their SH degree");
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

export async function openLevels(name) {
    if (location.protocol === "file:")
        throw new Error("its levels come from a web server; in its folder, python3 -m http.server is one");
    return (await fetched(name)).json();
}
