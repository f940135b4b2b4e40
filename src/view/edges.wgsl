// Smooths the stairs of a finished picture's edges (after Lottes, "FXAA", NVIDIA 2009, the console variant).

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var picture_sampler: sampler;

@vertex
fn whole_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let corner = vec2f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0);
    return vec4f(corner, 0.0, 1.0);
}

fn brightness(c: vec4f) -> f32 {
    return dot(c.rgb, vec3f(0.299, 0.587, 0.114));
}

@fragment
fn edges_fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let size = vec2f(textureDimensions(picture));
    let last = vec2i(textureDimensions(picture)) - 1;
    let at = vec2i(position.xy);
    let middle = textureLoad(picture, at, 0);
    let m = brightness(middle);
    let nw = brightness(textureLoad(picture, clamp(at + vec2i(-1, -1), vec2i(0), last), 0));
    let ne = brightness(textureLoad(picture, clamp(at + vec2i(1, -1), vec2i(0), last), 0));
    let sw = brightness(textureLoad(picture, clamp(at + vec2i(-1, 1), vec2i(0), last), 0));
    let se = brightness(textureLoad(picture, clamp(at + vec2i(1, 1), vec2i(0), last), 0));
    let low = min(m, min(min(nw, ne), min(sw, se)));
    let high = max(m, max(max(nw, ne), max(sw, se)));
    // The scan's own texture is smooth already; leave it alone.
    if high - low < max(0.06, high * 0.16) {
        return middle;
    }
    // Along the edge: across the gradient of brightness.
    var along = vec2f((sw + se) - (nw + ne), (nw + sw) - (ne + se));
    let damped = 1.0 / (min(abs(along.x), abs(along.y)) + max((nw + ne + sw + se) * 0.03125, 1.0 / 128.0));
    along = clamp(along * damped, vec2f(-8.0), vec2f(8.0)) / size;
    let centre = position.xy / size;
    let near = 0.5 * (textureSampleLevel(picture, picture_sampler, centre - along / 6.0, 0.0)
        + textureSampleLevel(picture, picture_sampler, centre + along / 6.0, 0.0));
    let far = 0.5 * near + 0.25 * (textureSampleLevel(picture, picture_sampler, centre - along * 0.5, 0.0)
        + textureSampleLevel(picture, picture_sampler, centre + along * 0.5, 0.0));
    let f = brightness(far);
    return select(far, near, f < low || f > high);
}
