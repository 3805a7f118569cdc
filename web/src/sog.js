// SPDX-License-Identifier: Apache-2.0
// Decodes a SOG of version 2 (src/io/splats/sog.h describes the layout).
/// Reads the bytes of images as they are stored: a 2D canvas would multiply colour by alpha.
class PixelReader {
    constructor(gl) {
        this.gl = gl;
        this.frame = gl.createFramebuffer();
    }

    async read(webp) {
        const image = await createImageBitmap(new Blob([webp], {type: "image/webp"}),
                                              {premultiplyAlpha: "none", colorSpaceConversion: "none"});
        const gl = this.gl, texture = gl.createTexture(), {width, height} = image;
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
        gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
        image.close();
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
        const data = new Uint8Array(4 * width * height);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, data);
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        gl.deleteTexture(texture);
        return {data, width, height};
    }

    close() { this.gl.deleteFramebuffer(this.frame); }
}

function positionsOf(meta, low, high) {
    const positions = new Float32Array(3 * meta.count);
    for (let axis = 0; axis < 3; ++axis) {
        const from = meta.means.mins[axis], step = (meta.means.maxs[axis] - from) / 65535;
        for (let i = 0; i < meta.count; ++i) {
            const v = from + step * (low[4 * i + axis] + 256 * high[4 * i + axis]);
            positions[3 * i + axis] = Math.sign(v) * Math.expm1(Math.abs(v));
        }
    }
    return positions;
}

/// Returns {count, degree, positions, packed, codebooks, palette}.
/// - packed: 8 uint32 a splat: x y z as float bits, the palette's row, the bytes of rotation, scale codes, and colour codes
///   with the opacity; one is unused here.
/// - codebooks: three tables of 256: standard deviations, SH degree 0, SH of higher degrees.
/// - palette: an image of SH codes, or null.
/// open(name) gives the bytes of a file of the SOG, at once or later. progress(0..1) is called on the way.
export async function decodeSog(gl, open, progress) {
    const meta = JSON.parse(new TextDecoder().decode(await open("meta.json")));
    const names = [...meta.means.files, ...meta.quats.files, ...meta.scales.files, ...meta.sh0.files,
                   ...(meta.shN ? meta.shN.files : [])];
    const reader = new PixelReader(gl);
    const images = new Map();
    try {
        for (const name of names) {
            images.set(name, await reader.read(await open(name)));
            progress(images.size / (names.length + 1));
        }
    } finally {
        reader.close();
    }
    const pixels = (part, i = 0) => images.get(meta[part].files[i]).data;
    const positions = positionsOf(meta, pixels("means", 0), pixels("means", 1));
    const words = (part, i = 0) => new Uint32Array(pixels(part, i).buffer);
    const rotations = words("quats"), scales = words("scales"), colors = words("sh0");
    const labels = meta.shN ? words("shN", 1) : null, places = new Uint32Array(positions.buffer);
    const packed = new Uint32Array(8 * meta.count);
    for (let i = 0; i < meta.count; ++i) {
        packed.set(places.subarray(3 * i, 3 * i + 3), 8 * i);
        packed[8 * i + 3] = labels ? labels[i] & 0xffff : 0;
        packed[8 * i + 4] = rotations[i];
        packed[8 * i + 5] = scales[i];
        packed[8 * i + 6] = colors[i];
    }
    const codebooks = new Float32Array(3 * 256);
    codebooks.set(meta.scales.codebook.map(Math.exp), 0);
    codebooks.set(meta.sh0.codebook, 256);
    if (meta.shN) codebooks.set(meta.shN.codebook, 512);
    progress(1);
    return {count: meta.count, degree: meta.shN ? meta.shN.bands : 0, antialias: Boolean(meta.antialias), positions, packed,
            codebooks, palette: meta.shN ? images.get(meta.shN.files[0]) : null};
}
