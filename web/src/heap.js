// SPDX-License-Identifier: Apache-2.0
// A binary heap. before(a, b): whether a is taken before b.
export class Heap {
    constructor(before) { Object.assign(this, {before, items: []}); }

    /// Adds an item; null adds none.
    add(item) {
        if (item === null) return;
        const {items} = this;
        let at = items.length;
        for (let above = (at - 1) >> 1; at > 0 && this.before(item, items[above]); above = (at - 1) >> 1) {
            items[at] = items[above];
            at = above;
        }
        items[at] = item;
    }

    /// Removes and returns the first item, or undefined.
    take() {
        const {items} = this, first = items[0], last = items.pop();
        if (items.length === 0) return first;
        let at = 0;
        for (let below = 1; below < items.length; below = 2 * at + 1) {
            if (below + 1 < items.length && this.before(items[below + 1], items[below])) ++below;
            if (!this.before(items[below], last)) break;
            items[at] = items[below];
            at = below;
        }
        items[at] = last;
        return first;
    }
}
