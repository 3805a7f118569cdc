// SPDX-License-Identifier: Apache-2.0
// Draws splats by WebGL2: quads of sorted splats, blended near to far.
import {screenFragment, screenVertex, splatFragment, splatVertex} from "./shaders.js";

function compile(gl, vertex, fragment) {
    const program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
        const shader = gl.createShader(type);
        gl.shaderSource(shader, source);
        gl.compileShader(shader);
        if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
        gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    const places = {};
    for (let i = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) - 1; i >= 0; --i) {
        const {name} = gl.getActiveUniform(program, i);
        places[name] = gl.getUniformLocation(program, name);
    }
    return {program, places};
}

export class Renderer {
    constructor(gl) {
        this.gl = gl;
        this.screen = compile(gl, screenVertex, screenFragment);
        // Eight bits would round after each splat.
        this.format = gl.getExtension("EXT_color_buffer_float") ? gl.RGBA16F
                    : gl.getExtension("EXT_color_buffer_half_float") ? gl.RGBA16F : gl.RGBA8;
        this.textures = [];
        this.kind = "";
        this.order = gl.createBuffer();
        this.count = 0;
        this.vertices = gl.createVertexArray();
        gl.bindVertexArray(this.vertices);
        gl.bindBuffer(gl.ARRAY_BUFFER, this.order);
        gl.enableVertexAttribArray(0);
        gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 0);
        gl.vertexAttribDivisor(0, 1);
        this.empty = gl.createVertexArray();
        this.target = {frame: gl.createFramebuffer(), picture: null, width: 0, height: 0};
    }

    /// Another scene in place of the present one, without an order. scene: of decodeSog or joined.
    setScene(scene) {
        const gl = this.gl, kind = `${scene.degree} ${scene.antialias} ${scene.chunks !== undefined}`;
        if (kind !== this.kind) this.splats = compile(gl, splatVertex(scene), splatFragment);
        this.kind = kind;
        for (const {texture} of this.textures) gl.deleteTexture(texture);
        const width = 2048, height = Math.max(1, Math.ceil(scene.count / 1024));
        if (height > gl.getParameter(gl.MAX_TEXTURE_SIZE))
            throw new Error(`this device cannot hold ${scene.count.toLocaleString("en")} splats`);
        const rows = new Uint32Array(4 * width * height), flat = gl.TEXTURE_2D;
        rows.set(scene.packed);
        const books = 3 * (scene.chunks ?? 1);
        this.textures = [{target: flat, texture: this.texture(gl.RGBA32UI, width, height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, rows)},
                         {target: flat, texture: this.texture(gl.R32F, 256, books, gl.RED, gl.FLOAT, scene.codebooks)}];
        if (scene.palette)
            this.textures.push({target: flat, texture: this.texture(gl.RGBA8UI, scene.palette.width, scene.palette.height,
                                                                    gl.RGBA_INTEGER, gl.UNSIGNED_BYTE, scene.palette.data)});
        if (scene.palettes?.length > 0) this.textures.push({target: gl.TEXTURE_2D_ARRAY, texture: this.layers(scene.palettes)});
        this.count = 0;
        gl.bindBuffer(gl.ARRAY_BUFFER, this.order);
        gl.bufferData(gl.ARRAY_BUFFER, 4 * Math.max(1, scene.count), gl.DYNAMIC_DRAW);
    }

    /// One layer for each palette; null leaves a layer of zeros.
    layers(palettes) {
        const gl = this.gl, target = gl.TEXTURE_2D_ARRAY, texture = gl.createTexture();
        const largest = (side) => Math.max(...palettes.map((palette) => palette?.[side] ?? 1));
        gl.bindTexture(target, texture);
        gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
        gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
        gl.texStorage3D(target, 1, gl.RGBA8UI, largest("width"), largest("height"), palettes.length);
        palettes.forEach((palette, layer) => {
            if (palette)
                gl.texSubImage3D(target, 0, 0, 0, layer, palette.width, palette.height, 1, gl.RGBA_INTEGER, gl.UNSIGNED_BYTE,
                                 palette.data);
        });
        return texture;
    }

    texture(format, width, height, layout, type, data) {
        const gl = this.gl, texture = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
        gl.texImage2D(gl.TEXTURE_2D, 0, format, width, height, 0, layout, type, data);
        return texture;
    }

    setOrder(order) {
        this.count = order.length;
        this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.order);
        this.gl.bufferSubData(this.gl.ARRAY_BUFFER, 0, order);
    }

    resize(width, height) {
        const gl = this.gl, target = this.target;
        if (target.width === width && target.height === height) return;
        if (target.picture) gl.deleteTexture(target.picture);
        const half = this.format === gl.RGBA16F;
        target.picture = this.texture(this.format, width, height, gl.RGBA, half ? gl.HALF_FLOAT : gl.UNSIGNED_BYTE, null);
        target.width = width;
        target.height = height;
        gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target.picture, 0);
    }

    /// camera: {eye, rows, lens}, lens in px of a width x height image. background: RGB, 0..1.
    draw(camera, width, height, background) {
        const gl = this.gl;
        this.resize(width, height);
        gl.viewport(0, 0, width, height);
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.target.frame);
        gl.clearColor(0, 0, 0, 0);
        gl.clear(gl.COLOR_BUFFER_BIT);
        gl.useProgram(this.splats.program);
        const places = this.splats.places;
        this.textures.forEach(({target, texture}, unit) => {
            gl.activeTexture(gl.TEXTURE0 + unit);
            gl.bindTexture(target, texture);
            gl.uniform1i(places[["splats", "codebooks", "palette"][unit]], unit);
        });
        gl.uniformMatrix3fv(places.rotation, true, camera.rows.flat());
        gl.uniform3fv(places.eye, camera.eye);
        gl.uniform4fv(places.lens, camera.lens);
        gl.uniform2f(places.size, width, height);
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.ONE_MINUS_DST_ALPHA, gl.ONE);
        gl.bindVertexArray(this.vertices);
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.count);
        gl.disable(gl.BLEND);

        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        gl.useProgram(this.screen.program);
        gl.activeTexture(gl.TEXTURE0);
        gl.bindTexture(gl.TEXTURE_2D, this.target.picture);
        gl.uniform1i(this.screen.places.picture, 0);
        gl.uniform3fv(this.screen.places.background, background);
        gl.bindVertexArray(this.empty);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
}
