// SPDX-License-Identifier: Apache-2.0
// Reads a zip archive of stored entries, as ewa writes a SOG.

const kEnd = 0x06054b50, kEntry = 0x02014b50;

/// The entries by name. bytes: the whole archive. Throws an Error for what is no such archive.
export function openArchive(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    let end = bytes.length - 22;
    while (end >= 0 && view.getUint32(end, true) !== kEnd) --end;
    if (end < 0) throw new Error("the scene in this page is damaged");
    const files = new Map();
    let at = view.getUint32(end + 16, true);
    for (let i = view.getUint16(end + 10, true); i > 0; --i) {
        if (view.getUint32(at, true) !== kEntry || view.getUint16(at + 10, true) !== 0)
            throw new Error("the scene in this page is damaged");
        const size = view.getUint32(at + 24, true), nameLength = view.getUint16(at + 28, true);
        const name = new TextDecoder().decode(bytes.subarray(at + 46, at + 46 + nameLength));
        const local = view.getUint32(at + 42, true);
        const data = local + 30 + view.getUint16(local + 26, true) + view.getUint16(local + 28, true);
        files.set(name, bytes.subarray(data, data + size));
        at += 46 + nameLength + view.getUint16(at + 30, true) + view.getUint16(at + 32, true);
    }
    return files;
}
